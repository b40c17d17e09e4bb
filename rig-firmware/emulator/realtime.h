/* Real time: the chip's clock follows the host's monotonic clock, and its UART is a terminal. */
#ifndef REALTIME_H
#define REALTIME_H

struct realtime_options {
	const char *elf;
	const char *link;	/* symbolic link to make to the terminal */
	const char *edges;	/* file for the STEP edges, or NULL */
};

/* Prints "ready LINK" and runs until stdin ends or a signal comes; commands of command.h are read
 * from stdin. Returns the exit status.
 *
 * The chip's cycle c belongs to the host's time (microseconds of CLOCK_MONOTONIC) t0 + c / 16, also
 * when the machine is too busy and the chip runs late for a while. Each line of the file of edges
 * is "CYCLE DIR MICROSECONDS".
 */
int realtime(const struct realtime_options *options);

#endif
