#include "lockstep.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "chip.h"
#include "command.h"

struct watch {
	bool line_ended;
};

static void print_event(void *context, const struct chip_event *event)
{
	static const char *const NAMES[] = {[CHIP_STEP] = "step", [CHIP_ENABLE] = "enable"};
	struct watch *watch = context;

	switch (event->kind) {
	case CHIP_SENT:
		watch->line_ended |= event->value == '\n';
		printf("tx %" PRIu64 " %02X\n", event->cycle, event->value);
		break;
	case CHIP_OVERRUN:
		printf("overrun %" PRIu64 " %02X\n", event->cycle, event->value);
		break;
	case CHIP_STEP:
	case CHIP_ENABLE:
		printf("%s %" PRIu64 " %u\n", NAMES[event->kind], event->cycle, event->value);
		break;
	}
}

static bool run(struct chip *chip, uint64_t cycles, const bool *until)
{
	uint64_t end = chip_cycle(chip) + cycles;

	while (chip_cycle(chip) < end && !(until != NULL && *until))
		if (!chip_run(chip))
			return false;
	return true;
}

static bool offer(struct chip *chip, const char *hex)
{
	unsigned byte;

	while (sscanf(hex, "%2x", &byte) == 1) {
		if (!chip_offer(chip, (uint8_t)byte))
			return false;
		hex += 2;
	}
	return true;
}

/* Returns what to complain of, NULL if nothing. */
static const char *obey(struct chip *chip, struct watch *watch, const char *line)
{
	uint64_t cycles;

	if (sscanf(line, "run %" SCNu64, &cycles) == 1)
		return run(chip, cycles, NULL) ? NULL : "the program crashed";
	if (sscanf(line, "line %" SCNu64, &cycles) == 1) {
		watch->line_ended = false;
		return run(chip, cycles, &watch->line_ended) ? NULL : "the program crashed";
	}
	if (strncmp(line, "rx ", 3) == 0)
		return offer(chip, line + 3) ? NULL : "too many bytes are on their way";
	if (strncmp(line, "stack", 5) == 0) {
		printf("stack %u\n", chip_stack_free(chip));
		return NULL;
	}
	return command_obey(chip, line) ? NULL : "no such command";
}

int lockstep(const char *elf)
{
	static char line[16384];
	struct watch watch = {0};
	struct chip *chip = chip_new(elf, print_event, &watch);
	const char *complaint = NULL;

	if (chip == NULL)
		return 1;
	while (complaint == NULL && fgets(line, sizeof line, stdin) != NULL) {
		complaint = obey(chip, &watch, line);
		printf("done %" PRIu64 "\n", chip_cycle(chip));
		fflush(stdout);
	}
	if (complaint != NULL)
		fprintf(stderr, "emulator: %s: %s", complaint, line);
	chip_free(chip);
	return complaint == NULL ? 0 : 1;
}
