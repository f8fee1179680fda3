"""From CSV files of one's own to a network that is judged on a person it has not seen."""

from pathlib import Path

import orbtouch

for number in range(4):  # simulated files stand in for your own
    table = orbtouch.simulate(minutes=1, user=number, rate_hz=10).to_pandas()
    table.to_csv(f"person{number}.csv")

recordings = []
for number, path in enumerate(sorted(Path().glob("person*.csv"))):
    recordings += orbtouch.import_recordings(
        path,
        frames="r[0-9]*",
        rows=5,
        columns=5,
        pitch_mm=10.0,
        user=f"0{number}",
        time="t",
        label="label",
        label_names="label_names",
        null="null",
    )
for number, one in enumerate(recordings):
    one.save(f"person{number}.npz")
made = orbtouch.train([f"person{number}.npz" for number in range(3)], "own.orb", epochs=4)
print(made.scores, made.network.evaluate(recordings[3]), sep="\n")
