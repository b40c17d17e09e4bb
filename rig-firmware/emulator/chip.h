/* The chip: an ATmega328P of libsimavr with the turntable's wires at its pins.
 *
 * What simavr 1.6 lacks for this purpose is made up for here: bytes last ten bits as on the wire
 * (there eleven), a receiver holds what a real one holds (there 64 bytes), input pins keep their
 * level when the program writes the port or the chip is reset, and memory is random at power-on.
 */
#ifndef CHIP_H
#define CHIP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Cycles of the chip's clock in a second. */
#define CHIP_HZ 16000000ull

enum chip_event_kind {
	CHIP_SENT,	/* a byte left the UART: value is the byte */
	CHIP_STEP,	/* STEP began: value is the level of DIR */
	CHIP_ENABLE,	/* ENABLE changed: value is its level */
	CHIP_OVERRUN,	/* the receiver lost the byte `value`: the program did not take it in time */
};

struct chip_event {
	enum chip_event_kind kind;
	uint64_t cycle;
	unsigned value;
};

enum chip_reset {
	CHIP_POWER_ON,
	CHIP_EXTERNAL,
	CHIP_BROWN_OUT,
};

enum chip_pin {
	CHIP_INDEX,
	CHIP_EMERGENCY_STOP,
};

/* Called for each event, in the order of time. */
typedef void (*chip_listener)(void *context, const struct chip_event *event);

struct chip;

/* Loads the program and resets it as at power-on; NULL, and a message on stderr, if that fails. */
struct chip *chip_new(const char *elf, chip_listener listener, void *context);
void chip_free(struct chip *chip);

/* Cycles since the start; goes on through resets. */
uint64_t chip_cycle(const struct chip *chip);

/* Runs one instruction; false once the program has crashed. */
bool chip_run(struct chip *chip);

/* Queues a byte for the receiver; false if the queue is full. */
bool chip_offer(struct chip *chip, uint8_t byte);
size_t chip_offer_room(const struct chip *chip);

void chip_set_pin(struct chip *chip, enum chip_pin pin, bool level);

/* Drives the index pin from the steps that were made: low while the count of steps since the start
 * of the emulation, modulo `period`, lies within first..last. A period of 0 ends it. */
void chip_place_index(struct chip *chip, long first, long last, long period);

/* Voltage at A5. */
void chip_set_battery(struct chip *chip, unsigned millivolts);

/* Resets the chip; the EEPROM stays. */
void chip_reset(struct chip *chip, enum chip_reset cause);

/* Lets the main program hang in an endless loop; interrupts work on. */
void chip_hang(struct chip *chip);

/* Bytes between the program's variables and the deepest stack so far. */
unsigned chip_stack_free(const struct chip *chip);

/* Damages a byte of the EEPROM. */
void chip_poke_eeprom(struct chip *chip, uint16_t address, uint8_t byte);

#endif
