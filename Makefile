# `make help` lists the targets.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.PHONY: help setup setup-programs setup-app setup-train training-data test test-day test-rig test-slurm test-objects test-field packages test-packages test-image test-python wheel bench-python image static release lint wasm app test-app demo bench bench-reader bench-network sheet docs fuzz firmware emulator flash

TARGET := $(or $(CARGO_TARGET_DIR),target)

# The programs from the rig to the shards.
PROGRAMS := -p relit-capture -p relit-mask -p relit-extract

# Features that making shards does not need; lint and tests cover them too.
EXTRAS := --features relit-capture/nokhwa,relit-mask/networks,relit-mask/opencv

# The recorded session of a whole turn, which the demonstration replays as a camera.
SESSION := 20261120T093015Z-cow
DEMO := $(TARGET)/demo

# The input of the benchmark, which scales it to 1080p, and the number of runs of each program.
BENCH_VIDEO ?= fixtures/$(SESSION)/video.mkv
BENCH_MASK ?= fixtures/$(SESSION)/mask_gt.png
BENCH_RUNS ?= 3
BENCH_VENV := $(TARGET)/bench-venv
OBJECTS_VENV := $(TARGET)/objects-venv
PYTHON_VENV := $(TARGET)/python-venv
FIELD_VENV := $(TARGET)/field-venv

# The turntable's firmware, and the emulated chip that its tests run on.
FIRMWARE := $(TARGET)/firmware
EMULATOR := $(FIRMWARE)/rig-emulator
EMULATOR_SOURCES := $(wildcard rig-firmware/emulator/*.c)
PORT ?= /dev/ttyACM0
# A Nano with the old boot loader has 57600.
FLASH_BAUD ?= 115200

FUZZ_SECONDS ?= 60
# A shard can claim sizes that it does not have: reading one must not allocate this many MiB at once.
FUZZ_SHARD_PIECE := 16

help: ## List the targets
	@sed -n 's/^\([a-z-]*\):.*## /  \1\t/p' Makefile | expand -t 15

setup: ## Install the system packages that are missing
	@.ci/setup

setup-programs:
	@.ci/setup --programs

setup-app:
	@.ci/setup --app

setup-train: ## Install libtorch, which relight's training is built with (544 MB, once)
	@.ci/setup-train

# MESHES and PANORAMAS are your own folders, in addition to the downloads. Files that are left out are listed (exit code 3).
LIBRARY ?= $(TARGET)/training-data/library.relib

training-data: ## Download objects and panoramas (210 MB) and pack them into LIBRARY, for relight train and relight synth
	cargo build --locked --release -p relight
	@.ci/training-data $(TARGET)/training-data
	$(TARGET)/release/relight synth library -o $(LIBRARY) \
	    --meshes $(TARGET)/training-data/furniture $(MESHES) \
	    --panoramas $(TARGET)/training-data/panoramas $(PANORAMAS) \
	    || [[ $$? == 3 ]]

# Cargo builds the programs before it runs the first test: those of the package relit-tests run several.
test: setup ## Run all tests; those of training where libtorch is installed
	@if rig-firmware/build --can && [[ -e /usr/include/simavr/sim_avr.h ]]; then \
	    $(MAKE) --no-print-directory firmware emulator; \
	else \
	    echo "the firmware's tests on the emulated chip are skipped: 'make setup' printed the reason"; \
	fi
	cargo test --locked --workspace $(EXTRAS) $$(.ci/setup-train --features)

test-rig: setup ## Capture with the kernel's camera drivers and a real tty, in a virtual machine
	@tests/rig-vm/run

# Pictures of each step are left in PICTURES.
PICTURES ?= $(TARGET)/day

test-day: setup ## Go through a day at the rig in a browser, with whole turns; pictures in PICTURES
	cargo build --locked --release $(PROGRAMS) --bins
	RELIT_PICTURES="$(abspath $(PICTURES))" cargo test --locked --release -p relit-tests --test day -- \
	    --include-ignored --test-threads 1

test-slurm: setup ## Extract as an array job on a real Slurm, started on this machine for it
	cargo build --locked -p relit-extract
	@tests/slurm/run $(TARGET)/debug/relit-extract

test-objects: setup $(OBJECTS_VENV)/ready ## Extract from and to object stores, with an S3 server on this machine
	cargo test --locked -p relit-extract --features object-store --lib objects
	cargo test --locked -p relit-extract --features object-store --test program objects
	cargo build --locked -p relit-extract --features object-store
	tests/objects/s3 $(TARGET)/debug/relit-extract $(abspath $(OBJECTS_VENV))/bin/python

test-field: setup $(FIELD_VENV)/ready ## Run the programs on files of cameras, phones and other programs
	cargo build --locked --release $(PROGRAMS) -p relight --bins
	$(FIELD_VENV)/bin/python tests/field/run --programs $(TARGET)/release

packages: setup-programs ## Make the Debian packages relit-rig, relit and relight
	@.ci/packages

test-packages: packages ## Install, use and purge the packages in clean Debian systems
	@tests/packages/run

test-image: image ## Run the container image without a daemon, as a cluster does
	@tests/packages/image

wheel: $(PYTHON_VENV)/ready ## Make the Python package, one wheel for Python 3.9 and newer
	$(PYTHON_VENV)/bin/maturin build --profile small --compression-level 9 --locked -m relight/python/Cargo.toml -i $(PYTHON_VENV)/bin/python \
	    --out target/packages

test-python: wheel $(DEMO)/mask.png ## Install the Python package and test it against the programs, with its notebooks; tests of torch run where it is installed
	cargo build --locked --release -p relight -p relit-mask
	$(PYTHON_VENV)/bin/pip install --quiet --force-reinstall --no-deps target/packages/relit-*.whl
	cd relight/python/tests && RELIT_DATA=$(abspath $(DEMO))/out RELIGHT=$(abspath $(TARGET))/release/relight \
	    RELIT_MASK=$(abspath $(TARGET))/release/relit-mask $(abspath $(PYTHON_VENV))/bin/python -m pytest -q -rs .

bench-python: wheel $(DEMO)/mask.png ## Measure the reader through Python against webdataset
	$(PYTHON_VENV)/bin/pip install --quiet --force-reinstall --no-deps target/packages/relit-*.whl
	$(PYTHON_VENV)/bin/pip install --quiet -r tests/bench/requirements.txt
	$(PYTHON_VENV)/bin/python tests/bench/python_reader.py --runs $(BENCH_RUNS) $(DEMO)/out

image: packages ## Make a container image of relit-extract, relit-mask and relight, as an OCI layout
	@.ci/image

static: ## Make relight as one file that needs no library
	@.ci/static

release: packages wheel image static ## Make a release: packages, wheel, image, static file, checksums, list of crates
	@.ci/release

lint: setup ## Check formatting, lints and documentation
	cargo fmt --all --check
	cargo run -q --locked -p relit-tests --bin relit-house
	cargo clippy --locked --workspace --all-targets $(EXTRAS),relit-extract/object-store,relit-fuzz/fuzzer \
	    $$(.ci/setup-train --features) -- -D warnings
	cargo clippy --locked -p relight -- -D warnings
	cargo clippy --locked $(PROGRAMS) --all-targets -- -D warnings
	cargo clippy --locked -p relit-data --no-default-features -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps $(EXTRAS)
	@if cargo tree --locked -p relight -e normal --prefix none \
	    | grep -E '^(ffmpeg|opencv|relit-(video|mask|capture|camera|turntable))'; then \
	    echo "relight must not depend on these"; exit 1; fi
	@if cargo tree --locked -p relit-extract -e normal --prefix none \
	    | grep -E '^(opencv|v4l|axum|hyper|tokio|relit-(mask|capture|camera|turntable|web))'; then \
	    echo "relit-extract must not depend on these"; exit 1; fi
	@if cargo tree --locked -p relit-grabcut -e normal --prefix none \
	    | grep -E '^(opencv|rayon|rustix|parquet|tar|clap|indicatif|relit-(video|web|mask))'; then \
	    echo "relit-grabcut must not depend on these"; exit 1; fi
	@.ci/dependencies
	@.ci/wasm --check
	cargo fmt --manifest-path rig-firmware/uno/Cargo.toml --check
	@if rig-firmware/build --can; then rig-firmware/build --clippy; fi

app: setup-app ## Build the app's page into target/page: its engine for WebAssembly, its weights and its files
	@.ci/app

test-app: app ## Test the page in headless Chromium, and compare it with the programs
	cargo build --locked --release -p relight -p relit-mask
	relight/app/tests/run $(TARGET)/page $(TARGET)/release/relight $(TARGET)/release/relit-mask

wasm: ## Build for WebAssembly the crates of the app's page
	@.ci/wasm

firmware: ## Build the turntable's firmware for Arduino Uno and Nano
	@rig-firmware/build $(FIRMWARE)

emulator: $(EMULATOR) ## Build the emulated chip for the firmware's tests

flash: firmware ## Flash the firmware to the Arduino at PORT (/dev/ttyACM0)
	avrdude -p atmega328p -c arduino -P $(PORT) -b $(FLASH_BAUD) -D \
	    -U flash:w:$(FIRMWARE)/rig-firmware-uno.hex:i

demo: setup-programs ## Record the turn in fixtures/ on a simulated rig faster than real time, make a shard of it, list the results
	cargo build --locked --release $(PROGRAMS) --bins
	rm -rf $(DEMO)
	$(TARGET)/release/relit-capture record --yes --object cow --root $(DEMO)/sessions \
	    --camera 'replay:fixtures/$(SESSION)?loop=1&speed=0' --turntable 'sim:?speed=0'
	@session=$$(echo $(DEMO)/sessions/*-cow); \
	$(TARGET)/release/relit-mask "$$session" --auto; \
	$(TARGET)/release/relit-extract "$$session" -o $(DEMO)/out; \
	$(TARGET)/release/relit-extract verify $(DEMO)/out; \
	cp "$$session/mask.png" $(DEMO)/mask.png; \
	echo; \
	echo "The recorded session:             $$session"; \
	echo "The mask, drawn over the frame:   $$session/mask-preview.png"; \
	echo "The report, for a browser:        $$(echo $(DEMO)/out/*-cow.html)"; \
	echo "The shard of 1500 samples:        $$(echo $(DEMO)/out/*-cow.tar)"

bench: setup $(BENCH_VENV)/ready ## Measure relit-extract at 1080p against ffmpeg and Python OpenCV
	cargo build --locked --release -p relit-extract --bins --example stages
	$(BENCH_VENV)/bin/python tests/bench/bench.py --program $(TARGET)/release/relit-extract \
	    --stages $(TARGET)/release/examples/stages \
	    --video $(BENCH_VIDEO) --mask $(BENCH_MASK) --runs $(BENCH_RUNS) --work $(TARGET)/bench

bench-reader: setup $(DEMO)/mask.png $(BENCH_VENV)/ready ## Measure relight's reader of shards against Python webdataset
	cargo build --locked --release -p relight-core --example read_turns
	$(BENCH_VENV)/bin/python tests/bench/reader.py --reader $(TARGET)/release/examples/read_turns \
	    --runs $(BENCH_RUNS) $(DEMO)/out

bench-network: setup-train $(BENCH_VENV)/torch-ready ## Measure relight's training against PyTorch's
	cargo build --locked --release -p relight-train --features libtorch --example network_speed
	$(BENCH_VENV)/bin/python tests/bench/network.py --program $(TARGET)/release/examples/network_speed \
	    --runs $(BENCH_RUNS)

sheet: setup ## Make twelve compositions of relight relight and relight insert, and a sheet of them
	cargo build --locked --release -p relight -p relit-extract --bins
	python3 tests/bench/sheet.py $(TARGET)/release fixtures $(TARGET)/sheet $(TARGET)/sheet.jpg

docs: setup ## Write the options of all programs into docs/reference, and build the libraries' reference
	RELIT_WRITE_HELP=1 cargo test --quiet --locked $(PROGRAMS) -p relight --test help
	cargo doc --locked --no-deps
	@echo "$(TARGET)/doc/relit_data/index.html"

fuzz: setup ## Run each fuzz target for FUZZ_SECONDS (60)
	cargo fuzz --version >/dev/null 2>&1 || cargo install --locked cargo-fuzz
	targets=$$(cargo fuzz list --fuzz-dir tests/fuzz); \
	for target in $$targets; do \
	    echo "fuzz: $$target"; \
	    mkdir -p "tests/fuzz/corpus/$$target"; \
	    RUSTC_BOOTSTRAP=1 cargo fuzz run --fuzz-dir tests/fuzz --features fuzzer "$$target" \
	        "tests/fuzz/corpus/$$target" "tests/fuzz/seeds/$$target" -- \
	        -max_total_time=$(FUZZ_SECONDS) \
	        -malloc_limit_mb=$$([[ $$target == shard_reader ]] && echo $(FUZZ_SHARD_PIECE) || echo 2048); \
	done

$(EMULATOR): $(EMULATOR_SOURCES) $(wildcard rig-firmware/emulator/*.h)
	@mkdir -p $(@D)
	$(CC) -std=c11 -O2 -Wall -Wextra -o $@ $(EMULATOR_SOURCES) -lsimavr -lelf

$(DEMO)/mask.png:
	$(MAKE) demo

$(OBJECTS_VENV)/ready: tests/objects/requirements.txt
	python3 -m venv $(OBJECTS_VENV)
	$(OBJECTS_VENV)/bin/pip install --quiet -r $<
	touch $@

$(FIELD_VENV)/ready: tests/field/requirements.txt
	python3 -m venv $(FIELD_VENV)
	$(FIELD_VENV)/bin/pip install --quiet -r $<
	touch $@

$(PYTHON_VENV)/ready: relight/python/requirements.txt
	python3 -m venv $(PYTHON_VENV)
	$(PYTHON_VENV)/bin/pip install --quiet -r $<
	touch $@

$(BENCH_VENV)/ready: tests/bench/requirements.txt
	python3 -m venv $(BENCH_VENV)
	$(BENCH_VENV)/bin/pip install --quiet -r $<
	touch $@

$(BENCH_VENV)/torch-ready: $(BENCH_VENV)/ready tests/bench/requirements-network.txt
	$(BENCH_VENV)/bin/pip install --quiet -r tests/bench/requirements-network.txt
	touch $@
