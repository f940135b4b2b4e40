# understudy: `make` says what can be made. CARGO_TARGET_DIR, UNDERSTUDY_ASSETS and OUT are taken from the environment.
SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.PHONY: help setup build demo test bench lint clean

export PATH := $(PATH):$(HOME)/.cargo/bin
DATA_HOME := $(or $(XDG_DATA_HOME),$(HOME)/.local/share)
export UNDERSTUDY_ASSETS ?= $(DATA_HOME)/understudy
TARGET := $(or $(CARGO_TARGET_DIR),target)
VALIDATOR := $(abspath $(TARGET))/gltf-validator
OUT ?= out
DEMO := $(addprefix $(OUT)/demo.,mp4 glb pc2 csv png)

help: ## list what can be made
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /  make \1\t/' | expand -t 16

setup: ## fetch system packages, models, clips and scans (again: checks them)
	@scripts/setup.sh

build: ## build the program, optimised
	cargo build --release

demo: setup build ## animate the scan from the demonstration clip, in every output format
	@mkdir -p $(OUT)
	@rm -f $(DEMO)
	$(TARGET)/release/understudy animate $(UNDERSTUDY_ASSETS)/clips/cap13_edit2.mp4 \
	    --target $(UNDERSTUDY_ASSETS)/scans/james.obj $(addprefix -o ,$(DEMO)) --compare </dev/null
	@echo "Made:"
	@for file in $(DEMO); do \
	    [ -s "$$file" ] || { echo "  ✗ $$file was not made" >&2; exit 1; }; \
	    printf '  %8s  %s\n' "$$(du -h "$$file" | cut -f1)" "$$file"; \
	done

test: setup ## run all tests, and the examples in the documentation
	@mkdir -p $(VALIDATOR) && cp tests/reference/gltf_validator/package*.json $(VALIDATOR)
	@npm ci --silent --prefix $(VALIDATOR)
	GLTF_VALIDATOR_DIR=$(VALIDATOR) cargo test --release --lib --bins --tests --examples
	cargo test --release --doc

bench: setup ## run the benchmarks, then the comparison with other programs
	cargo bench
	@if [ -x scripts/bench.sh ]; then scripts/bench.sh; fi

lint: ## formatting, clippy and the shell scripts
	cargo fmt --check
	cargo clippy --release --all-targets -- -D warnings
	@if command -v shellcheck >/dev/null; then shellcheck scripts/*.sh .ci/run; fi

clean: ## remove what was built and made; the assets stay
	cargo clean
	rm -rf $(OUT)
