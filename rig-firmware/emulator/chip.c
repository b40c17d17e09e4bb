#include "chip.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

/* The functions to the receiver's queue, which simavr's header only announces. */
DEFINE_FIFO(uint16_t, uart_fifo);

#define SRAM_START 0x100u
#define MCUSR 0x54
#define UBRR0L 0xC4
#define UBRR0H 0xC5

/* "rjmp .": the flash word that chip_hang jumps to. */
static const uint8_t ENDLESS_LOOP[2] = {0xFF, 0xCF};

/* What a receiver holds: two bytes, and one in its shift register. */
#define RECEIVER_HOLDS 3

#define OFFERED 8192u
#define PAINT 0xC5

struct chip {
	avr_t *avr;
	avr_uart_t *uart;
	avr_run_t normal_run;
	chip_listener listener;
	void *context;

	uint8_t offered[OFFERED];
	size_t offered_first, offered_count;
	bool receiving;

	bool level[2];
	bool step_level, direction, enable;
	long steps;
	long index_first, index_last, index_period;
	unsigned variables_end;
	uint32_t random;
};

static void tell(struct chip *chip, enum chip_event_kind kind, unsigned value)
{
	const struct chip_event event = {.kind = kind, .cycle = chip->avr->cycle, .value = value};

	chip->listener(chip->context, &event);
}

/* The time of ten bits, from the divisor that the program has set (always U2X). */
static uint32_t byte_cycles(const struct chip *chip)
{
	const uint8_t *data = chip->avr->data;

	return 10u * 8u * (1u + data[UBRR0L] + ((data[UBRR0H] & 0x0Fu) << 8));
}

static void on_sent(struct avr_irq_t *irq, uint32_t value, void *param)
{
	struct chip *chip = param;

	(void)irq;
	chip->uart->cycles_per_byte = byte_cycles(chip);
	tell(chip, CHIP_SENT, value & 0xFF);
}

/* A byte has come in whole. */
static void deliver(struct chip *chip, uint8_t byte)
{
	if (uart_fifo_get_read_size(&chip->uart->input) >= RECEIVER_HOLDS) {
		avr_regbit_set(chip->avr, chip->uart->dor);
		tell(chip, CHIP_OVERRUN, byte);
		return;
	}
	/* simavr waits a byte's time before it tells the program of a byte. */
	chip->uart->cycles_per_byte = 1;
	avr_raise_irq(chip->uart->io.irq + UART_IRQ_INPUT, byte);
	chip->uart->cycles_per_byte = byte_cycles(chip);
}

static avr_cycle_count_t on_received(struct avr_t *avr, avr_cycle_count_t when, void *param)
{
	struct chip *chip = param;

	(void)avr;
	deliver(chip, chip->offered[chip->offered_first]);
	chip->offered_first = (chip->offered_first + 1) % OFFERED;
	chip->offered_count--;
	if (chip->offered_count == 0) {
		chip->receiving = false;
		return 0;
	}
	return when + byte_cycles(chip);
}

static void start_receiving(struct chip *chip)
{
	if (!chip->receiving && chip->offered_count > 0) {
		chip->receiving = true;
		avr_cycle_timer_register(chip->avr, byte_cycles(chip), on_received, chip);
	}
}

static void drive(struct chip *chip, char port, int bit, bool level)
{
	avr_ioport_external_t external = {.name = port, .mask = 1u << bit, .value = level << bit};

	avr_ioctl(chip->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &external);
	/* The pins of simavr pass changes only, and a reset has cleared what they showed. */
	avr_irq_t *pin = avr_io_getirq(chip->avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit);
	pin->value = !level;
	avr_raise_irq(pin, level);
}

static void drive_pin(struct chip *chip, enum chip_pin pin)
{
	if (pin == CHIP_INDEX)
		drive(chip, 'B', 1, chip->level[pin]);
	else
		drive(chip, 'C', 0, chip->level[pin]);
}

/* What a reset inside of simavr takes away. */
static void settle_after_reset(struct chip *chip)
{
	/* Else it would look at STEP, which could be an interrupt's input, in every cycle. */
	avr_extint_set_strict_lvl_trig(chip->avr, 0, 0);
	avr_extint_set_strict_lvl_trig(chip->avr, 1, 0);
	drive_pin(chip, CHIP_INDEX);
	drive_pin(chip, CHIP_EMERGENCY_STOP);
	/* All timers were dropped. */
	chip->receiving = false;
	start_receiving(chip);
}

static void follow_steps(struct chip *chip)
{
	if (chip->index_period == 0)
		return;
	long at = chip->steps % chip->index_period;
	if (at < 0)
		at += chip->index_period;
	bool level = at < chip->index_first || at > chip->index_last;
	if (level != chip->level[CHIP_INDEX])
		chip_set_pin(chip, CHIP_INDEX, level);
}

static void on_step(struct avr_irq_t *irq, uint32_t value, void *param)
{
	struct chip *chip = param;
	bool level = value & 1;

	(void)irq;
	if (level == chip->step_level)
		return;
	chip->step_level = level;
	if (!level)
		return;
	/* DIR is low for a positive turn. */
	chip->steps += chip->direction ? -1 : 1;
	tell(chip, CHIP_STEP, chip->direction);
	follow_steps(chip);
}

static void on_direction(struct avr_irq_t *irq, uint32_t value, void *param)
{
	(void)irq;
	((struct chip *)param)->direction = value & 1;
}

static void on_enable(struct avr_irq_t *irq, uint32_t value, void *param)
{
	struct chip *chip = param;
	bool level = value & 1;

	(void)irq;
	if (level == chip->enable)
		return;
	chip->enable = level;
	tell(chip, CHIP_ENABLE, level);
}

static void listen(struct chip *chip, char port, int bit, avr_irq_notify_t notify)
{
	avr_irq_register_notify(avr_io_getirq(chip->avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit),
				notify, chip);
}

static void wire(struct chip *chip)
{
	listen(chip, 'D', 2, on_step);
	listen(chip, 'D', 5, on_direction);
	listen(chip, 'B', 0, on_enable);
	avr_irq_register_notify(
		avr_io_getirq(chip->avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_sent, chip);
}

static avr_uart_t *find_uart(avr_t *avr)
{
	for (avr_io_t *io = avr->io_port; io != NULL; io = io->next)
		if (strcmp(io->kind, "uart") == 0)
			return (avr_uart_t *)io;
	return NULL;
}

static void never_sleep(avr_t *avr, avr_cycle_count_t how_long)
{
	(void)avr;
	(void)how_long;
}

/* simavr logs to stdout, which belongs to the lock-step protocol. */
static void log_to_stderr(avr_t *avr, const int level, const char *format, va_list arguments)
{
	if (level <= (avr == NULL ? LOG_ERROR : avr->log))
		vfprintf(stderr, format, arguments);
}

static void randomise_memory(struct chip *chip)
{
	for (unsigned at = SRAM_START; at <= chip->avr->ramend; at++) {
		chip->random = chip->random * 1664525u + 1013904223u;
		chip->avr->data[at] = chip->random >> 24;
	}
	memset(chip->avr->data + chip->variables_end, PAINT,
	       chip->avr->ramend + 1u - chip->variables_end);
}

static bool load(struct chip *chip, const char *elf)
{
	elf_firmware_t firmware = {0};

	if (elf_read_firmware(elf, &firmware) != 0) {
		fprintf(stderr, "emulator: %s is no ELF file for an AVR: build it anew\n", elf);
		return false;
	}
	chip->avr = avr_make_mcu_by_name("atmega328p");
	if (chip->avr == NULL) {
		fprintf(stderr, "emulator: this libsimavr knows no atmega328p\n");
		return false;
	}
	avr_init(chip->avr);
	chip->avr->sleep = never_sleep;
	chip->avr->log = LOG_ERROR;
	chip->avr->frequency = CHIP_HZ;
	chip->avr->vcc = chip->avr->avcc = chip->avr->aref = 5000;
	avr_load_firmware(chip->avr, &firmware);
	chip->avr->frequency = CHIP_HZ;
	memcpy(chip->avr->flash + chip->avr->flashend - 1, ENDLESS_LOOP, sizeof ENDLESS_LOOP);
	/* Variables that nothing clears lie behind the others: eight bytes are more than enough. */
	chip->variables_end = SRAM_START + firmware.datasize + firmware.bsssize + 8;
	chip->normal_run = chip->avr->run;
	chip->uart = find_uart(chip->avr);
	return chip->uart != NULL;
}

struct chip *chip_new(const char *elf, chip_listener listener, void *context)
{
	struct chip *chip = calloc(1, sizeof *chip);

	if (chip == NULL)
		return NULL;
	avr_global_logger_set(log_to_stderr);
	chip->listener = listener;
	chip->context = context;
	chip->level[CHIP_INDEX] = chip->level[CHIP_EMERGENCY_STOP] = true;
	chip->random = 1;
	if (!load(chip, elf)) {
		free(chip);
		return NULL;
	}
	uint32_t quiet = 0;
	avr_ioctl(chip->avr, AVR_IOCTL_UART_SET_FLAGS('0'), &quiet);
	wire(chip);
	chip_reset(chip, CHIP_POWER_ON);
	return chip;
}

void chip_free(struct chip *chip)
{
	avr_terminate(chip->avr);
	free(chip);
}

uint64_t chip_cycle(const struct chip *chip)
{
	return chip->avr->cycle;
}

bool chip_run(struct chip *chip)
{
	/* For a reset by the watchdog simavr exchanges this function for one turn. */
	bool resets = chip->avr->run != chip->normal_run;
	int state = avr_run(chip->avr);

	if (resets && chip->avr->run == chip->normal_run)
		settle_after_reset(chip);
	return state != cpu_Crashed && state != cpu_Done;
}

size_t chip_offer_room(const struct chip *chip)
{
	return OFFERED - chip->offered_count;
}

bool chip_offer(struct chip *chip, uint8_t byte)
{
	if (chip_offer_room(chip) == 0)
		return false;
	chip->offered[(chip->offered_first + chip->offered_count) % OFFERED] = byte;
	chip->offered_count++;
	start_receiving(chip);
	return true;
}

void chip_set_pin(struct chip *chip, enum chip_pin pin, bool level)
{
	chip->level[pin] = level;
	drive_pin(chip, pin);
}

void chip_place_index(struct chip *chip, long first, long last, long period)
{
	chip->index_first = first;
	chip->index_last = last;
	chip->index_period = period;
	follow_steps(chip);
}

void chip_set_battery(struct chip *chip, unsigned millivolts)
{
	avr_raise_irq(avr_io_getirq(chip->avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC5), millivolts);
}

void chip_reset(struct chip *chip, enum chip_reset cause)
{
	static const uint8_t FLAG[] = {
		[CHIP_POWER_ON] = 1 << 0, [CHIP_EXTERNAL] = 1 << 1, [CHIP_BROWN_OUT] = 1 << 2};

	if (cause == CHIP_POWER_ON)
		randomise_memory(chip);
	avr_reset(chip->avr);
	chip->avr->data[MCUSR] = FLAG[cause];
	settle_after_reset(chip);
}

void chip_hang(struct chip *chip)
{
	/* Not within an interrupt: the emulated watchdog, unlike a real one, waits for ever for its
	 * own to be served. */
	for (unsigned tries = 0; tries < 100000 && !chip->avr->sreg[S_I]; tries++)
		chip_run(chip);
	chip->avr->pc = chip->avr->flashend - 1;
}

unsigned chip_stack_free(const struct chip *chip)
{
	unsigned at = chip->variables_end;

	while (at <= chip->avr->ramend && chip->avr->data[at] == PAINT)
		at++;
	return at - chip->variables_end;
}

void chip_poke_eeprom(struct chip *chip, uint16_t address, uint8_t byte)
{
	avr_eeprom_desc_t place = {.ee = &byte, .offset = address, .size = 1};

	avr_ioctl(chip->avr, AVR_IOCTL_EEPROM_SET, &place);
}
