# `make help` lists the targets.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.PHONY: help setup test test-rig lint demo bench docs fuzz

TARGET := $(or $(CARGO_TARGET_DIR),target)

# The recorded session of a whole turn, and the rectangle around its object; its folder holds
# seeds that somebody painted.
SESSION := 20261120T093015Z-cow
RECT := 170,20,325,390
DEMO := $(TARGET)/demo

# The input of the benchmark, and how often each program runs.
BENCH_VIDEO ?= fixtures/$(SESSION)/video.mkv
BENCH_MASK ?= $(DEMO)/$(SESSION)/mask.png
BENCH_RUNS ?= 5
BENCH_VENV := $(TARGET)/bench-venv

FUZZ_SECONDS ?= 60
# A shard can claim sizes that nothing bears out: reading one takes no piece of so many MiB.
FUZZ_SHARD_PIECE := 16

help: ## List the targets
	@sed -n 's/^\([a-z-]*\):.*## /  \1\t/p' Makefile | expand -t 10

setup: ## Install the system packages that are missing
	@.ci/setup

test: setup ## Run all tests
	cargo test --locked

test-rig: setup ## Capture with the kernel's camera drivers and a real tty, in a virtual machine
	@tests/rig-vm/run

lint: setup ## Check formatting, lints and documentation
	cargo fmt --all --check
	cargo clippy --locked --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps

demo: setup ## Make a shard of the recorded turn in fixtures/, verify it, and say where to look
	cargo build --locked --release --bins
	rm -rf $(DEMO)
	mkdir -p $(DEMO)
	cp -r fixtures/$(SESSION) $(DEMO)/
	$(TARGET)/release/relit-mask $(DEMO)/$(SESSION) --rect $(RECT) \
	    --seeds fixtures/$(SESSION)/seeds.png
	$(TARGET)/release/relit-extract $(DEMO)/$(SESSION) -o $(DEMO)/out
	$(TARGET)/release/relit-extract verify $(DEMO)/out
	@echo
	@echo "The mask, drawn over the frame:   $(DEMO)/$(SESSION)/mask-preview.png"
	@echo "The report, for a browser:        $(DEMO)/out/$(SESSION).html"
	@echo "The shard of 1500 samples:        $(DEMO)/out/$(SESSION).tar"

bench: setup $(BENCH_MASK) $(BENCH_VENV)/ready ## Measure relit-extract against ffmpeg and Python OpenCV
	cargo build --locked --release --bins
	$(BENCH_VENV)/bin/python tests/bench/bench.py --program $(TARGET)/release/relit-extract \
	    --video $(BENCH_VIDEO) --mask $(BENCH_MASK) --runs $(BENCH_RUNS) --work $(TARGET)/bench

docs: setup ## Build the library's reference
	cargo doc --locked --no-deps
	@echo "$(TARGET)/doc/relit/index.html"

fuzz: setup ## Run each fuzz target for FUZZ_SECONDS (60)
	cargo fuzz --version >/dev/null 2>&1 || cargo install --locked cargo-fuzz
	targets=$$(cargo fuzz list --fuzz-dir tests/fuzz); \
	for target in $$targets; do \
	    echo "fuzz: $$target"; \
	    mkdir -p "tests/fuzz/corpus/$$target"; \
	    RUSTC_BOOTSTRAP=1 cargo fuzz run --fuzz-dir tests/fuzz "$$target" \
	        "tests/fuzz/corpus/$$target" "tests/fuzz/seeds/$$target" -- \
	        -max_total_time=$(FUZZ_SECONDS) \
	        -malloc_limit_mb=$$([[ $$target == shard_reader ]] && echo $(FUZZ_SHARD_PIECE) || echo 2048); \
	done

$(DEMO)/$(SESSION)/mask.png:
	$(MAKE) demo

$(BENCH_VENV)/ready: tests/bench/requirements.txt
	python3 -m venv $(BENCH_VENV)
	$(BENCH_VENV)/bin/pip install --quiet -r $<
	touch $@
