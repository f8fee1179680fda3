// Prints the counts of one to four MPR121 as a line a frame, at 40 Hz.
// Boards: any with I2C. Chips at 0x5A, 0x5B, ... in order.
#include <Wire.h>

const uint8_t CHIPS = 1;
const uint8_t FIRST_ADDRESS = 0x5A;
const uint8_t ELECTRODES = 12;
const unsigned long PERIOD_MS = 25;

void set(uint8_t address, uint8_t place, uint8_t value) {
  Wire.beginTransmission(address);
  Wire.write(place);
  Wire.write(value);
  Wire.endTransmission();
}

void setup() {
  Serial.begin(115200);
  Wire.begin();
  Wire.setClock(400000);
  for (uint8_t chip = 0; chip < CHIPS; chip++) {
    uint8_t address = FIRST_ADDRESS + chip;
    set(address, 0x80, 0x63);               // soft reset
    set(address, 0x5C, 0x10);               // charge with 16 uA
    set(address, 0x5D, 0x21);               // for 0.5 us, every 2 ms
    set(address, 0x5E, 0x40 | ELECTRODES);  // run, without a baseline of its own
  }
}

void loop() {
  static unsigned long due = millis();
  for (uint8_t chip = 0; chip < CHIPS; chip++) {
    uint8_t address = FIRST_ADDRESS + chip;
    Wire.beginTransmission(address);
    Wire.write(0x04);
    Wire.endTransmission(false);
    Wire.requestFrom(address, (uint8_t)(2 * ELECTRODES));
    for (uint8_t electrode = 0; electrode < ELECTRODES; electrode++) {
      uint16_t low = Wire.read();
      uint16_t high = Wire.read();
      if (chip || electrode) Serial.print(',');
      Serial.print(low | (high & 3) << 8);
    }
  }
  Serial.println();
  while ((long)(millis() - due) < (long)PERIOD_MS) {}
  due += PERIOD_MS;
}
