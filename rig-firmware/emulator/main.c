/* Runs the turntable's firmware, the very ELF that is flashed, on an emulated chip. */
#include <getopt.h>
#include <stdio.h>

#include "lockstep.h"
#include "realtime.h"

static const char USAGE[] =
	"usage: rig-emulator ELF                              commands on stdin (lockstep.h)\n"
	"       rig-emulator ELF --pty LINK [--edges FILE]    a serial port in real time\n";

int main(int argc, char **argv)
{
	static const struct option OPTIONS[] = {
		{"pty", required_argument, NULL, 'p'},
		{"edges", required_argument, NULL, 'e'},
		{"help", no_argument, NULL, 'h'},
		{0},
	};
	struct realtime_options options = {0};

	for (int option; (option = getopt_long(argc, argv, "", OPTIONS, NULL)) != -1;) {
		switch (option) {
		case 'p':
			options.link = optarg;
			break;
		case 'e':
			options.edges = optarg;
			break;
		case 'h':
			fputs(USAGE, stdout);
			return 0;
		default:
			fputs(USAGE, stderr);
			return 2;
		}
	}
	if (optind + 1 != argc || (options.edges != NULL && options.link == NULL)) {
		fputs(USAGE, stderr);
		return 2;
	}
	options.elf = argv[optind];
	return options.link == NULL ? lockstep(options.elf) : realtime(&options);
}
