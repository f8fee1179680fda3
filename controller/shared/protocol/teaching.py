"""Messages for teaching gestures over the link: requests 51 to 67, reports 11, 13 to 15, 26 to 31.

Registered with those of `messages`; docs/protocol.md is the specification.
"""

from dataclasses import dataclass
from typing import Annotated, Final

from controller.shared.protocol import codec
from controller.shared.protocol.messages import Report, Request, message

LEARNING, DONE, FAILED = range(3)  # states of a LearnStatus
MOST_RULES: Final = 8  # in a GestureInfo
MOST_PIXELS: Final = 400  # of a gesture's image; there is none of a larger grid

Image = Annotated[bytes, codec.octets(MOST_PIXELS)]  # rows * columns or b"": `quantise_image`


@message(51)
class Describe(Request):
    """Host to device: a request for the gestures in use; Vocabulary and GestureInfos follow."""


@message(52)
class ExampleStart(Request):
    """Host to device: the player begins an example of a gesture now."""

    number: codec.U32  # of the example, chosen by the host; each number is used once
    label: codec.Text40  # a new or a known gesture


@message(53)
class ExampleEnd(Request):
    """Host to device: the example ends now; ExampleTaken follows unless `keep` is False."""

    number: codec.U32
    keep: codec.Bool


@message(54)
class ExampleDrop(Request):
    """Host to device: delete an example that was taken."""

    number: codec.U32


@message(55)
class Learn(Request):
    """Host to device: learn a gesture, anew if it was taught, from its pending examples."""

    label: codec.Text40
    command: codec.Text40  # "": nothing
    rotations: codec.Text40  # under which it is the same gesture: "none", "half" or "all"
    mirrored: codec.Bool  # its mirror image is the same gesture
    user: codec.Text40  # user of a gesture that was not taught; "": everybody


@message(56)
class Forget(Request):
    """Host to device: remove a taught gesture."""

    label: codec.Text40


@message(57)
class Undo(Request):
    """Host to device: take the bundle before the last change into use."""


@message(58)
class SaveAs(Request):
    """Host to device: keep a copy of the bundle in use; an existing file is never replaced."""

    name: codec.Text40  # of the file, without its ending


@message(59)
class SetCommand(Request):
    """Host to device: the command of a gesture, wherever it is made, from now on."""

    label: codec.Text40  # "", with a user: the user has no commands of their own any more
    command: codec.Text40  # "": nothing
    user: codec.Text40 = ""  # enrolled user that it is for; "": everybody


@message(60)
class DeleteExamples(Request):
    """Host to device: delete all pending examples and recordings made over the link."""


@message(61)
class Record(Request):
    """Host to device: start or stop recording the session into the user's data folder."""

    on: codec.Bool


@message(62)
class RecordLabel(Request):
    """Host to device: the gesture that the player is asked for from now on while recording."""

    label: codec.Text40  # "null": rest


@message(63)
class InjectFault(Request):
    """Host to virtual device: the only fault of the orb from now on, with its usual size."""

    kind: codec.Text40  # of `controller.simulator.dome.faults`; "": no fault
    row: codec.U8  # of a taxel or row; else ignored
    column: codec.U8  # of a taxel or column; else ignored


@message(64)
class Recalibrate(Request):
    """Host to device: measure the untouched sensor again; not ready until that is done."""


@message(65)
class Check(Request):
    """Host to device: calibrate and check the sensor, or stop that; CheckStep, CheckRow follow."""

    on: codec.Bool


@message(66)
class SetStrength(Request):
    """Host to device: a user's touch strength; see `controller.shared.touch_strength`."""

    strength: codec.Deviation  # 0: the user has none any more
    user: codec.Text40 = ""  # enrolled user; "": everybody without one


@message(67)
class SetWaiting(Request):
    """Host to device: whether older gestures wait for a taught one that begins like them."""

    label: codec.Text40
    wait: codec.Bool


@message(26)
class Vocabulary(Report):
    """Device to host: the gestures in use; the answer to Describe, and after every change.

    A GestureInfo of each label but "null", a UserInfo of each enrolled user, and each TouchStrength
    follow. Telemetry is in the order of `labels` from here.
    """

    labels: codec.Names  # "null" first
    commands: codec.Names  # as in Welcome
    bundle: codec.Text64  # name of the bundle in use; "": the one that ships
    undo: codec.Bool  # whether `Undo` has something to undo
    taught: codec.U8  # number of taught gestures
    folder: Annotated[str, codec.text(255)]  # where the player's data is
    objection: Annotated[str, codec.sentence(200)] = ""  # why nothing can be changed; "": it can


@dataclass(frozen=True, slots=True)
class CommandRule:
    """A command, and the region of touches that it is for; see `controller.recognition.mapping`."""

    command: codec.Text40
    left_of: codec.Bound  # grid units; infinite: no bound
    right_of: codec.Bound
    below: codec.Bound
    above: codec.Bound


@message(27)
class GestureInfo(Report):
    """Device to host: one gesture of the Vocabulary before it."""

    label: codec.Text40
    say: codec.Text64  # its name for people
    taught: codec.Bool  # whether `Forget` can remove it
    examples: codec.U16  # in the bundle
    image: Image  # mean of its examples or rehearsal data at their firmest; b"": unknown
    rules: Annotated[tuple[CommandRule, ...], codec.many(codec.record(CommandRule), MOST_RULES)]


@message(14)
class UserInfo(Report):
    """Device to host: one enrolled user of the bundle, after the GestureInfos."""

    user: codec.Text40
    labels: codec.Names  # gestures with a mapping of the user's own; once for each command
    commands: codec.Names  # of each of them; "none": nothing


@message(13)
class TouchStrength(Report):
    """Device to host: a user's touch strength, after the UserInfos; older devices send none."""

    user: codec.Text40  # with a strength of their own; "": everybody else
    strength: codec.Deviation


@message(28)
class ExampleTaken(Report):
    """Device to host: the outcome of an example; sent again after Describe while it is pending."""

    number: codec.U32
    label: codec.Text40
    felt: codec.Bool  # whether it is stored and can be learned
    text: codec.Sentence500  # why not; "" if it is
    seconds: codec.Deviation  # duration of its touch; 0 without one
    image: Image  # at its firmest; b"" without a touch
    rotations: codec.Text40 = "none"  # as in Learn: guess from the examples of the label so far
    mirrored: codec.Bool = False  # guess, too


@message(29)
class LearnStatus(Report):
    """Device to host: progress and outcome of a change, after the new Vocabulary if it has one."""

    state: codec.U8  # LEARNING, DONE, FAILED
    progress: codec.Share
    text: codec.Sentence500  # or ""
    # empty; of earlier devices, for each of Vocabulary.labels the share of rehearsed touches kept
    kept: codec.Shares = ()


@message(11)
class LessonCost(Report):
    """Device to host: what a gesture became by the last lesson, in simulated play; after Learn.

    Latencies are medians from the onset of the touch, seconds; 0 where none was understood.
    """

    taught: codec.Text40  # the gesture that was learned
    label: codec.Text40  # the one that was played
    of: codec.U8  # how often
    before: codec.U8  # how often it was understood before the lesson,
    before_s: codec.Deviation
    now: codec.U8  # after it,
    now_s: codec.Deviation
    eager: codec.U8  # and if no older gesture waited for the taught one
    eager_s: codec.Deviation


@message(30)
class RecordingStatus(Report):
    """Device to host: the answer to Record, and when a recording ends by itself."""

    on: codec.Bool
    text: codec.Sentence500  # where it lies, or why there is none


@message(31)
class CheckStep(Report):
    """Device to host: what is to be done now: "rest", "press", "lift", or "over": nothing more."""

    step: codec.Text40
    row: codec.U8  # of the taxel to press; else ignored
    column: codec.U8
    progress: codec.Share  # of the whole check


@message(15)
class CheckRow(Report):
    """Device to host: one row of the doctor's table, as `controller.diagnostics.report.Row`."""

    name: Annotated[str, codec.sentence(120)]
    verdict: codec.Text40
    found: Annotated[str, codec.sentence(250)]
    advice: Annotated[str, codec.sentence(250)]
    code: codec.Text40


TEACHING: Final = (  # the requests
    *(Describe, ExampleStart, ExampleEnd, ExampleDrop, Learn, Forget, Undo, SaveAs, SetCommand),
    *(DeleteExamples, Record, RecordLabel, InjectFault, Recalibrate, Check),
    *(SetStrength, SetWaiting),
)
