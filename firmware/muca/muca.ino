// Prints the 252 values of a Muca board as a line a frame; some 9 Hz at 115,200 baud.
// Needs the library Muca of the board's makers.
#include <Muca.h>

Muca muca;

void setup() {
  Serial.begin(115200);
  muca.init();
  muca.useRawData(true);
}

void loop() {
  if (!muca.updated()) return;
  for (int i = 0; i < NUM_ROWS * NUM_COLUMNS; i++) {
    if (i) Serial.print(',');
    Serial.print(muca.grid[i]);
  }
  Serial.println();
}
