/* Commands that both ways of use understand: what the world does to the chip. */
#ifndef COMMAND_H
#define COMMAND_H

#include <stdbool.h>

#include "chip.h"

/* Obeys one line; false if it is none of these:
 *
 *   pin index|estop 0|1          the level at an input
 *   index FIRST LAST PERIOD      index low while the step count (mod PERIOD) is within FIRST..LAST
 *   battery MILLIVOLTS           at A5
 *   reset [power-on|external|brown-out]
 *   hang                         the program stands still
 *   eeprom ADDRESS BYTE          a byte of the EEPROM, both decimal
 */
bool command_obey(struct chip *chip, const char *line);

#endif
