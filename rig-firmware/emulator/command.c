#include "command.h"

#include <stdio.h>
#include <string.h>

static bool set_pin(struct chip *chip, const char *name, int level)
{
	if (strcmp(name, "index") == 0)
		chip_set_pin(chip, CHIP_INDEX, level != 0);
	else if (strcmp(name, "estop") == 0)
		chip_set_pin(chip, CHIP_EMERGENCY_STOP, level != 0);
	else
		return false;
	return true;
}

static bool reset(struct chip *chip, const char *cause)
{
	if (strcmp(cause, "power-on") == 0)
		chip_reset(chip, CHIP_POWER_ON);
	else if (strcmp(cause, "external") == 0)
		chip_reset(chip, CHIP_EXTERNAL);
	else if (strcmp(cause, "brown-out") == 0)
		chip_reset(chip, CHIP_BROWN_OUT);
	else
		return false;
	return true;
}

bool command_obey(struct chip *chip, const char *line)
{
	char word[16];
	long first, last, period;
	unsigned address, value;
	int level;

	if (sscanf(line, "pin %15s %d", word, &level) == 2)
		return set_pin(chip, word, level);
	if (sscanf(line, "index %ld %ld %ld", &first, &last, &period) == 3 && period >= 0) {
		chip_place_index(chip, first, last, period);
		return true;
	}
	if (sscanf(line, "battery %u", &value) == 1) {
		chip_set_battery(chip, value);
		return true;
	}
	if (sscanf(line, "reset %15s", word) == 1)
		return reset(chip, word);
	if (sscanf(line, "eeprom %u %u", &address, &value) == 2 && address < 1024 && value < 256) {
		chip_poke_eeprom(chip, (uint16_t)address, (uint8_t)value);
		return true;
	}
	if (strncmp(line, "hang", 4) == 0) {
		chip_hang(chip);
		return true;
	}
	return false;
}
