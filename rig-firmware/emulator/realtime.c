#define _GNU_SOURCE
#include "realtime.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "chip.h"
#include "command.h"

#define CYCLES_PER_US ((uint64_t)(CHIP_HZ / 1000000))
/* After being late the chip catches up by so much between two looks at the line. */
#define LONGEST_TURN (20000 * CYCLES_PER_US)

struct session {
	struct chip *chip;
	int terminal, far_end;
	FILE *edges;
	uint64_t start_us;
	uint8_t sent[4096];
	size_t sent_count;
	char command[256];
	size_t command_length;
};

static volatile sig_atomic_t stopped;

static void on_signal(int number)
{
	(void)number;
	stopped = 1;
}

static uint64_t now_us(void)
{
	struct timespec now;

	clock_gettime(CLOCK_MONOTONIC, &now);
	return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

static void on_event(void *context, const struct chip_event *event)
{
	struct session *session = context;

	if (event->kind == CHIP_SENT && session->sent_count < sizeof session->sent)
		session->sent[session->sent_count++] = (uint8_t)event->value;
	if (event->kind == CHIP_STEP && session->edges != NULL)
		fprintf(session->edges, "%" PRIu64 " %u %" PRIu64 "\n", event->cycle, event->value,
			session->start_us + event->cycle / CYCLES_PER_US);
	if (event->kind == CHIP_OVERRUN)
		fprintf(stderr, "emulator: the receiver lost a byte at cycle %" PRIu64 "\n",
			event->cycle);
}

/* Holding the far end open too keeps the line up between two users of it. */
static bool open_terminal(struct session *session, const char *link)
{
	session->terminal = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
	if (session->terminal < 0 || grantpt(session->terminal) || unlockpt(session->terminal))
		return false;
	const char *name = ptsname(session->terminal);
	session->far_end = name == NULL ? -1 : open(name, O_RDWR | O_NOCTTY);
	if (session->far_end < 0)
		return false;
	struct termios raw;
	if (tcgetattr(session->far_end, &raw) != 0)
		return false;
	cfmakeraw(&raw);
	if (tcsetattr(session->far_end, TCSANOW, &raw) != 0)
		return false;
	if (unlink(link) != 0 && errno != ENOENT)
		return false;
	return symlink(name, link) == 0;
}

static void take_from_line(struct session *session)
{
	uint8_t bytes[256];
	size_t room = chip_offer_room(session->chip);
	ssize_t count = read(session->terminal, bytes, room < sizeof bytes ? room : sizeof bytes);

	for (ssize_t i = 0; i < count; i++)
		chip_offer(session->chip, bytes[i]);
}

static void give_to_line(struct session *session)
{
	if (session->sent_count == 0)
		return;
	ssize_t count = write(session->terminal, session->sent, session->sent_count);
	/* A line that nobody reads is full in the end; then the oldest bytes stay, the rest is lost,
	 * as on a wire. */
	if (count > 0 && (size_t)count < session->sent_count)
		memmove(session->sent, session->sent + count, session->sent_count - (size_t)count);
	if (count > 0)
		session->sent_count -= (size_t)count;
}

/* False at the end of stdin, or after a line that is no command. */
static bool take_commands(struct session *session)
{
	char *line = session->command;
	ssize_t count = read(STDIN_FILENO, line + session->command_length,
			     sizeof session->command - 1 - session->command_length);

	if (count <= 0)
		return count < 0 && (errno == EINTR || errno == EAGAIN);
	session->command_length += (size_t)count;
	line[session->command_length] = '\0';
	for (char *end; (end = strchr(line, '\n')) != NULL;) {
		*end = '\0';
		if (!command_obey(session->chip, line)) {
			fprintf(stderr, "emulator: no such command: %s\n", line);
			return false;
		}
		session->command_length -= (size_t)(end + 1 - line);
		memmove(line, end + 1, session->command_length + 1);
	}
	return session->command_length + 1 < sizeof session->command;
}

static bool catch_up(struct session *session)
{
	uint64_t due = (now_us() - session->start_us) * CYCLES_PER_US;
	uint64_t limit = chip_cycle(session->chip) + LONGEST_TURN;

	while (chip_cycle(session->chip) < due && chip_cycle(session->chip) < limit)
		if (!chip_run(session->chip)) {
			fprintf(stderr, "emulator: the program crashed\n");
			return false;
		}
	return true;
}

static void serve(struct session *session)
{
	struct pollfd watched[] = {
		{.fd = session->terminal, .events = POLLIN},
		{.fd = STDIN_FILENO, .events = POLLIN},
	};

	while (!stopped) {
		/* A millisecond is a tenth of a byte's way through a USB adapter. */
		poll(watched, 2, 1);
		if (watched[0].revents & POLLIN)
			take_from_line(session);
		if (watched[1].revents != 0 && !take_commands(session))
			return;
		if (!catch_up(session))
			return;
		give_to_line(session);
	}
}

int realtime(const struct realtime_options *options)
{
	struct session session = {.terminal = -1, .far_end = -1};
	struct sigaction action = {.sa_handler = on_signal};

	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
	if (options->edges != NULL && (session.edges = fopen(options->edges, "w")) == NULL) {
		fprintf(stderr, "emulator: %s: %s\n", options->edges, strerror(errno));
		return 1;
	}
	if (!open_terminal(&session, options->link)) {
		fprintf(stderr, "emulator: %s: no terminal: %s\n", options->link, strerror(errno));
		return 1;
	}
	session.chip = chip_new(options->elf, on_event, &session);
	if (session.chip == NULL)
		return 1;
	session.start_us = now_us();
	printf("ready %s\n", options->link);
	fflush(stdout);
	serve(&session);
	unlink(options->link);
	if (session.edges != NULL)
		fclose(session.edges);
	close(session.far_end);
	close(session.terminal);
	chip_free(session.chip);
	return 0;
}
