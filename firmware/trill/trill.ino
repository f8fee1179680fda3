// Prints the 30 channels of a Trill Craft or Flex as a line a frame, at 40 Hz.
// Needs the library Trill of the sensor's makers. Differential values: at rest all are about 0.
#include <Trill.h>

Trill trill;
const unsigned long PERIOD_MS = 25;

void setup() {
  Serial.begin(115200);
  while (trill.setup(Trill::TRILL_CRAFT) != 0) delay(500);
  trill.setMode(Trill::DIFF);
}

void loop() {
  static unsigned long due = millis();
  trill.requestRawData();
  for (bool first = true; trill.rawDataAvailable() > 0; first = false) {
    if (!first) Serial.print(' ');
    Serial.print(trill.rawDataRead());
  }
  Serial.println();
  while ((long)(millis() - due) < (long)PERIOD_MS) {}
  due += PERIOD_MS;
}
