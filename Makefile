# `make demo` and `make test` need only Rust, git and a C compiler: tools/setup installs the rest.

# rustup's own folder, for shells that have not read its settings yet.
export PATH := $(PATH):$(HOME)/.cargo/bin

# What conda installed is found by pkg-config, and by the program when it runs, only when told where it is.
# This is looked up anew for each command, since tools/setup may have just installed it.
ifdef CONDA_PREFIX
export PKG_CONFIG_PATH := $(if $(PKG_CONFIG_PATH),$(PKG_CONFIG_PATH):)$(CONDA_PREFIX)/lib/pkgconfig
export RUSTFLAGS += $(shell [ ! -e '$(CONDA_PREFIX)/lib/pkgconfig/cfitsio.pc' ] || echo '-Clink-arg=-Wl,-rpath,$(CONDA_PREFIX)/lib')
endif

# The folders that `make demo` writes and `make gallery` keeps its data in, what `make bench` and `make kernels` measure,
# and flags for every cargo command that resolves packages, such as --locked.
DEMO = demo
GALLERY = gallery
NSIDE = 512
KERNELS =
CARGOFLAGS =

.PHONY: help demo gallery test check licences house bench kernels install clean setup checkers

help: ## list the targets
	@awk -F':.*## ' '/^[a-z]+:.*## / { printf "make %-9s %s\n", $$1, $$2 }' Makefile

demo: setup ## build longan and write its demonstration into demo/
	cargo run --release --bin longan $(CARGOFLAGS) -- demo $(DEMO) --overwrite

gallery: setup ## draw the figures of the README and the docs from data made in gallery/
	cargo build --release --bin longan --example gallery $(CARGOFLAGS)
	target/release/examples/gallery $(GALLERY)
	tools/gallery target/release/longan $(GALLERY) docs/gallery

# The tests come last, so that what the run ends with is their own summary.
test: checkers check ## run every check and test
	python=$$(tools/setup python) && env $${python:+LONGAN_PYTHON="$$python"} \
	cargo test --workspace --no-fail-fast $(CARGOFLAGS)

# clippy and doc share one compilation of the dependencies, the tests' build is the second and last.
check: setup licences house ## check the format, the lints, the documentation, the licences and the crates
	@tools/setup lints
	cargo fmt --all --check
	cargo clippy --workspace --all-targets $(CARGOFLAGS) -- -D warnings
	RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps $(CARGOFLAGS)

# The crates with the sources of HDF5 and netCDF name no licence, and carry theirs, which are as BSD's.
BSD = hdf5-metno-src|netcdf-src

# Refused are a dependency that names no licence and one whose every choice is of the GPL family. An AND beside
# a GPL may nest in ways that a person has to read, so it is refused too.
licences: ## check that no dependency forces a GPL licence on longan
	@tree=$$(cargo tree --workspace --all-features --edges normal --prefix none --format '{l}|{p}' $(CARGOFLAGS)) && \
	echo "$$tree" | awk -F'|' ' \
		$$2 ~ /^($(BSD)) / && $$1 == "" { next } \
		NF { free = 0; split($$1, choices, / OR |\//); for (i in choices) if (choices[i] !~ /GPL/) free = 1 } \
		NF && (!free || $$1 ~ /GPL.* AND | AND .*GPL/) { print "licence refused: " $$2 " has \"" $$1 "\""; bad = 1 } \
		END { exit bad }'

# Without Python 3 this check alone is left out; nothing else in longan's build needs it.
house: ## check that crates and files depend on each other as ARCHITECTURE.md says
	@if command -v python3 >/dev/null; then tools/house $(CARGOFLAGS); \
	else echo "house: no python3, so ARCHITECTURE.md is not held against the crates" >&2; fi

bench: setup ## compare longan's speed with that of its peers (NSIDE=512), plugins with built-ins, many maps with one
	cargo build --release --workspace $(CARGOFLAGS)
	python=$$(tools/setup python) && "$${python:-python3}" benches/peers.py $(NSIDE)
	python3 benches/plugins.py
	python3 benches/ensemble.py
	@if command -v cdo >/dev/null && command -v nccopy >/dev/null; then python3 benches/regrid.py; \
	else echo "bench: no cdo or nccopy, so regridding is not compared with it" >&2; fi

# KERNELS takes a word of a benchmark's name, and options of criterion.
kernels: setup ## measure the inner loops with criterion (KERNELS='--baseline NAME' compares, CONTRIBUTING.md)
	cargo bench -p longan -p longan-grid --bench kernels $(CARGOFLAGS) -- $(KERNELS)

install: setup ## install longan with cargo
	cargo install --path cli --locked

clean: ## remove what was built
	cargo clean
	rm -rf $(DEMO) $(GALLERY)

setup:
	@tools/setup

checkers: setup
	@tools/setup checkers
