/* Lock-step: time goes on only by command, so that a test is the same every time. */
#ifndef LOCKSTEP_H
#define LOCKSTEP_H

/* Serves commands on stdin until its end; returns the exit status.
 *
 * Beside those of command.h:
 *
 *   run CYCLES       runs that long
 *   line CYCLES      runs until the chip has sent a line's end, at most that long
 *   rx HEX           offers bytes to the UART, one after the other at its baud rate
 *   stack            prints how many bytes the stack has left untouched
 *
 * Prints, with the chip's cycle:
 *
 *   tx CYCLE HEX | step CYCLE DIR | enable CYCLE LEVEL | overrun CYCLE HEX
 *   stack BYTES | done CYCLE (ends the answer to every command)
 */
int lockstep(const char *elf);

#endif
