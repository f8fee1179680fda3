// Prints the touch pins of an ESP32 (not C3, C6, H2) as a line a frame, at 40 Hz.
// A touch lowers the reading of the ESP32, and raises that of the S2 and S3: see esp32_touch.toml.
// The pins below are the ESP32's; the S2 and S3 have them at 1 to 14.
const uint8_t PINS[] = {4, 13, 12, 14, 27, 33, 32, 15, 2};
const unsigned long PERIOD_MS = 25;

void setup() {
  Serial.begin(115200);
}

void loop() {
  static unsigned long due = millis();
  for (uint8_t i = 0; i < sizeof PINS; i++) {
    if (i) Serial.print(',');
    Serial.print((unsigned long)touchRead(PINS[i]));
  }
  Serial.println();
  while ((long)(millis() - due) < (long)PERIOD_MS) yield();
  due += PERIOD_MS;
}
