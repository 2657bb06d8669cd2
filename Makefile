# The front door. CMake does the work; `make help` lists what can be done.

MAKEFLAGS += --no-print-directory
BUILD := build
# Where the measured frames and scans are, for `make accept` and `make eval`.
DATA ?= ../shared/data
# A folder with unity.c, or one with cJSON.c: used instead of fetching the source package.
UNITY_DIR ?= $(BUILD)/third_party/unity/src
CJSON_DIR ?= $(BUILD)/third_party/cjson
# A folder with the sources of libgpiod 2: used instead of fetching them.
GPIOD2_DIR ?= $(BUILD)/third_party/gpiod2
# A folder with qemu-plugin.h: used instead of fetching QEMU's source package.
QEMU_PLUGIN_DIR ?= $(BUILD)/third_party/qemu
# The builds whose outputs of every stage are compared; make test takes those of -O3 for this machine and arm64.
GOLDEN_ALL := gcc-O0 gcc-O3 clang-O0 clang-O3 arm64-O0 arm64-O3 armhf-O2 riscv64-O2 s390x-O2 ppc64-O2 \
  mps2-an386-O2 mps2-an500-O2 mps3-an547-O2
# How many mistakes make mutation makes in the core and in what switches the laser, and how many per cent of them
# tests must catch, those that change nothing among them.
MUTANTS ?= 500
CAUGHT_MIN ?= 85
LASER_MUTANTS ?= 150
LASER_CAUGHT_MIN ?= 80
# What make view builds.
VIEW := $(BUILD)/view/tools/view/view

# pip of the venv that make python makes; packages of its list and no others.
PYTHON_PIP := $(BUILD)/python/venv/bin/pip --quiet --disable-pip-version-check --no-input

# The frames directory that make export takes.
FRAMES ?= frames/sequence2
# Runs of make kills; make test takes 60.
KILLS ?= 5000
# What make people makes, and where: a kind of scene, a rig and a seed of tools/people/make.py.
KIND ?= hands
RIG ?= paper
SEED ?= 1
OUT ?= $(BUILD)/people/$(RIG)_$(KIND)_$(SEED)
SETS ?= judge
# Frames of make longrun; make test takes a few hundred.
LONGRUN_FRAMES ?= 100000
# What the board's program is built for: arm64, armhf or host.
ARCH ?= arm64
# Where make install puts things; DESTDIR stands before it.
PREFIX ?= /usr/local
DESTDIR ?=

.DEFAULT_GOAL := help
.PHONY: help sim install frames sanitize test check unit kills fuzz coverage ranges exhaustive mutation accept eval eval-people misaligned \
  bench bench-instructions bench-peers bench-grow bench-worst test-bench bits cortexm longrun size vectors learn learn-pose view figures \
  test-view test-report site live-pictures export python people board board-gpiod2 deb deb-tools image flash calibrate test-calibration \
  test-calibration-short test-deb test-board test-image format formatted words layout links lint clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z_-]+:.*## / { \
	  count = split($$2, word, " "); line = sprintf("  make %-22s", $$1); \
	  for (i = 1; i <= count; i++) { \
	    if (length(line " " word[i]) > 80) { print line; line = sprintf("%29s", "") } \
	    line = line " " word[i] \
	  } \
	  print line }' $(MAKEFILE_LIST)

sim: ## build host_sim, and render frames/ if they are not there
	@tools/setup.sh sim
	@cmake --preset host > $(BUILD)/host.log 2>&1 || { cat $(BUILD)/host.log; exit 1; }
	@cmake --build --preset host --parallel 2
	@$(MAKE) frames

frames: frames/sequence1/rig.json frames/sequence2/rig.json

install: ## install libraries, headers, CMake and pkg-config files, host_sim: PREFIX=/usr/local DESTDIR=
	@tools/setup.sh sim
	@cmake --preset install -DCMAKE_INSTALL_PREFIX=$(PREFIX) > $(BUILD)/install.log 2>&1 || { cat $(BUILD)/install.log; exit 1; }
	@cmake --build --preset install --parallel 2
	@DESTDIR=$(DESTDIR) cmake --install $(BUILD)/install

# rig.json is written last: it stands for the whole directory.
frames/sequence%/rig.json:
	@mkdir -p frames
	@$(BUILD)/host/tools/render/render --sequence $* --seed $* frames/sequence$*

# The build of the tests, which has every source that there is.
sanitize: sim
	@tools/setup.sh test
	@cmake --preset sanitize -DISOHEAD_UNITY_DIR=$(abspath $(UNITY_DIR)) \
	  -DISOHEAD_CJSON_SOURCE_DIR=$(abspath $(CJSON_DIR)) \
	  -DISOHEAD_GPIOD2_DIR=$(abspath $(GPIOD2_DIR)) \
	  > $(BUILD)/sanitize.log 2>&1 || { cat $(BUILD)/sanitize.log; exit 1; }

test: sanitize ## every test: units against float64, sanitizers, bad input, rules of the core, same bits
	@cmake --build --preset sanitize --parallel 2
	@ctest --test-dir $(BUILD)/sanitize --output-on-failure --parallel 2

check: sanitize ## what to run every few minutes: unit tests, bad input, the rules of the tree; three minutes
	@cmake --build --preset sanitize --parallel 2 --target check_programs
	@ctest --test-dir $(BUILD)/sanitize --label-regex '^(unit|check)$$' --output-on-failure --parallel 2

unit: sanitize ## one unit test: NAME=dots runs tests/unit/dots/test_dots.c
	@[ -n "$(NAME)" ] || { echo "make unit NAME=dots: which test of tests/unit?" >&2; exit 2; }
	@cmake --build --preset sanitize --parallel 2 --target test_$(NAME)
	@$(BUILD)/sanitize/tests/test_$(NAME)

test-report: sim ## the report page in a browser; pictures of it in build/test_report
	@tools/setup.sh test-report
	@/usr/bin/python3 -B tests/report/report.py --host-sim $(BUILD)/host/sim/host_sim --frames frames \
	  --keep $(BUILD)/test_report

site: sim ## all pages as a static site in build/site, with a report page of the rendered frames in it
	@tools/setup.sh site
	@$(BUILD)/host/sim/host_sim --report $(BUILD)/site_report.html frames > /dev/null
	@/usr/bin/python3 -B tools/site.py $(BUILD)/site $(BUILD)/site_report.html

live-pictures: sanitize ## the live view's page in a browser: docs/live.png anew
	@tools/setup.sh test-report
	@cmake --build --preset sanitize --parallel 2 --target isohead_board
	@/usr/bin/python3 -B tests/board/live_page.py $(BUILD)/sanitize/firmware/app/isohead_board frames/sequence2 docs

kills: sanitize ## program and guards killed and stopped at random, KILLS times (5000): how long the laser stays on
	@cmake --build --preset sanitize --parallel 2 --target kills
	@$(BUILD)/sanitize/tests/kills $(KILLS)

coverage: sim ## the lines and branches of the core and of the board's program that their tests run, against limits
	@tools/setup.sh coverage
	@cmake --preset coverage -DISOHEAD_UNITY_DIR=$(abspath $(UNITY_DIR)) -DISOHEAD_GPIOD2_DIR=$(abspath $(GPIOD2_DIR)) \
	  > $(BUILD)/coverage.log 2>&1 || { cat $(BUILD)/coverage.log; exit 1; }
	@find $(BUILD)/coverage -name '*.gcda' -delete
	@cmake --build --preset coverage --parallel 2
	@ctest --test-dir $(BUILD)/coverage --label-regex '^core$$' --output-on-failure --parallel 2
	@/usr/bin/python3 tests/checks/coverage.py core $(BUILD)/coverage
	@find $(BUILD)/coverage -name '*.gcda' -delete
	@ctest --test-dir $(BUILD)/coverage --label-regex '^board$$' --output-on-failure --parallel 2
	@/usr/bin/python3 tests/checks/coverage.py board $(BUILD)/coverage

ranges: sim ## the core with every operation and range checked, over all frames, its tests, the fuzzers' corpus
	@tools/setup.sh ranges
	@tests/checks/ranges.sh --all $(UNITY_DIR) $(BUILD)/host/tests/golden frames $(wildcard $(DATA)/dots $(DATA)/range)

exhaustive: sim ## square root, division, angle and the surface's basis for all input, not in strides; minutes
	@tools/setup.sh ranges
	@tests/checks/exhaustive.sh $(UNITY_DIR)

mutation: sim ## would the tests notice? Mistakes made in the core and in the laser's code one at a time; half an hour
	@tools/setup.sh mutation
	@$(BUILD)/host/tests/golden/golden_pack $(BUILD)/golden.bin \
	  $(foreach n,1 2,$(addprefix frames/sequence$n/,rig.json 000024.pgm 000025.pgm 000026.pgm))
	@/usr/bin/python3 tests/checks/mutation.py --count $(MUTANTS) --min $(CAUGHT_MIN) --unity $(abspath $(UNITY_DIR)) \
	  --golden $(BUILD)/golden.bin
	@/usr/bin/python3 tests/checks/mutation.py laser --count $(LASER_MUTANTS) --min $(LASER_CAUGHT_MIN) \
	  --unity $(abspath $(UNITY_DIR))

fuzz: ## fuzz every target with libFuzzer and AFL++, FUZZ_SECONDS each (default 60) or FUZZ_RUNS; a table
	@tools/setup.sh fuzz
	@tests/fuzz/run.sh $(abspath $(CJSON_DIR))

accept: sim ## the measured limits on the data sets in DATA (default ../shared/data)
	@tools/setup.sh accept
	@tests/accept/accept.sh $(BUILD)/host/sim/host_sim $(DATA)

eval: sim ## everything measured: all data sets, fresh scenes, each part left out; pictures of failures
	@tools/setup.sh eval
	@/usr/bin/python3 tools/eval/evaluate.py --host-sim $(BUILD)/host/sim/host_sim \
	  --render $(BUILD)/host/tools/render/render --work $(BUILD)/eval --data $(DATA)

eval-people: sim ## which of the people of true anatomy are found that nothing was learnt from; SETS=judge (default), ten minutes
	@tools/setup.sh people
	@for set in $(SETS); do /usr/bin/python3 tools/people/sets.py $$set $(BUILD)/people/$$set || exit 1; done
	@/usr/bin/python3 tools/eval/people.py --host-sim $(BUILD)/host/sim/host_sim $(addprefix $(BUILD)/people/,$(SETS))

misaligned: sim ## rig files that are wrong: what is found and labelled; seven minutes, with SHORT=1 one; OPTIONS="--rows X"
	@tools/setup.sh eval
	@/usr/bin/python3 tools/eval/misaligned.py --host-sim $(BUILD)/host/sim/host_sim \
	  --render $(BUILD)/host/tools/render/render --work $(BUILD)/misaligned $(if $(SHORT),--short) $(OPTIONS)

bits: sim ## the same bits from gcc and clang, -O0 and -O3, on nine processors, three of them Cortex-M
	@tools/setup.sh bits
	@tools/setup.sh cortexm
	@tests/golden/golden.sh $(abspath $(CJSON_DIR)) frames $(GOLDEN_ALL)
	@tests/checks/same_bits.sh $(abspath $(CJSON_DIR)) frames $(wildcard $(DATA)/dots $(DATA)/range)

cortexm: sim ## the same bits and records on emulated Cortex-M4, M7 and M55 boards
	@tools/setup.sh cortexm
	@tests/golden/cortexm.sh $(abspath $(CJSON_DIR)) frames
	@tests/golden/cortexm_records.sh $(abspath $(CJSON_DIR)) frames $(BUILD)/host

size: sim ## flash, RAM, stack and instructions of each stage on a Cortex-M7, against tests/limits.conf
	@tools/setup.sh size
	@tools/size/size.sh $(abspath $(CJSON_DIR)) frames $(BUILD)/host/tools/rigblob/rigblob $(QEMU_PLUGIN_DIR)

longrun: sim ## 100,000 frames in one process: same memory, same records at the end as at the start
	@tests/longrun/longrun.sh $(BUILD)/host/tests/longrun/longrun $(BUILD)/host/tools/render/render \
	  $(BUILD)/longrun $(LONGRUN_FRAMES)

bench: sim ## time isohead against the same work by OpenCV and Eigen: build/bench.json; minutes
	@tools/setup.sh bench
	@/usr/bin/python3 tools/bench/timing.py

bench-instructions: sim ## instructions of each stage, by callgrind, with both compilers
	@tools/setup.sh bench
	@/usr/bin/python3 tools/bench/counts.py

bench-peers: sim ## instructions of isohead beside those of the same work by OpenCV and Eigen
	@tools/setup.sh bench
	@/usr/bin/python3 tools/bench/counts.py --peers

bench-grow: sim ## how the instructions of a frame grow with its size, dots, centres, grid, levels
	@tools/setup.sh bench
	@/usr/bin/python3 tools/bench/grow.py

bench-worst: sim ## which of 10,000 frames costs most, and why; up to 20 minutes
	@tools/setup.sh size
	@tools/setup.sh bench
	@/usr/bin/python3 tools/bench/worst.py --plugin-header $(QEMU_PLUGIN_DIR)

test-bench: sim ## do isohead and what it is compared with find the same?
	@tools/setup.sh bench
	@/usr/bin/python3 tools/bench/agree.py

vectors: ## write tests/vectors anew with the float64 reference; STAGES=dots: of these stages alone
	@tools/setup.sh vectors
	@/usr/bin/python3 tools/oracle/make_vectors.py --out tests/vectors $(STAGES)

learn: sim ## learn the score anew from rendered scenes and people; four hours
	@tools/setup.sh learn
	@tools/setup.sh people
	@/usr/bin/python3 tools/people/sets.py learn $(BUILD)/learn/people/level
	@/usr/bin/python3 tools/people/sets.py mounted_learn $(BUILD)/learn/people/mounted
	@/usr/bin/python3 tools/people/sets.py anywhere_learn $(BUILD)/learn/people/anywhere
	@/usr/bin/python3 tools/people/sets.py more_learn $(BUILD)/learn/people/more
	@/usr/bin/python3 tools/people/sets.py missing_learn $(BUILD)/learn/people/missing --rigs paper wide
	@/usr/bin/python3 tools/people/sets.py mounted_missing_learn $(BUILD)/learn/people/mounted_missing --rigs paper wide
	@OPENBLAS_NUM_THREADS=1 /usr/bin/python3 tools/learn/learn.py --render $(BUILD)/host/tools/render/render \
	  --host-sim $(BUILD)/host/sim/host_sim --work $(BUILD)/learn --people $(addprefix $(BUILD)/learn/people/,level mounted anywhere more missing mounted_missing)
	@/usr/bin/python3 tools/learn/draw_maps.py docs/pictures/maps.svg

learn-pose: ## learn anew where heads look, from people that dots are cast on; half an hour
	@tools/setup.sh vectors
	@tools/setup.sh people
	@mkdir -p $(BUILD)/learn
	@$(CC) -O2 -shared -fPIC -Ifirmware/core tools/people/cast_points.c $(wildcard firmware/core/*.c firmware/core/*/*.c) \
	  -o $(BUILD)/learn/libcast.so
	@/usr/bin/python3 tools/people/cast.py $(BUILD)/learn/libcast.so $(BUILD)/learn/heads.npz
	@/usr/bin/python3 tools/learn/learn_pose.py $(BUILD)/learn/heads.npz

view: sim ## build tools/view, pictures of frames and what was found in them: build/view/tools/view/view
	@tools/setup.sh view
	@cmake --preset view > $(BUILD)/view.log 2>&1 || { cat $(BUILD)/view.log; exit 1; }
	@cmake --build --preset view --parallel 2 --target view

figures: view ## draw docs/figure1.png, docs/figure2.png (the paper's), docs/figure_control.png and the learnt maps anew
	@$(VIEW) contours --from 000022 frames/sequence2 docs/figure1.png
	@$(VIEW) sheet --from 000020 frames/sequence2 docs/figure2.png
	@$(VIEW) control --from 000010 frames/sequence1 docs/figure_control.png
	@tools/setup.sh vectors
	@/usr/bin/python3 tools/learn/draw_maps.py docs/pictures/maps.svg

test-view: view ## what tools/view draws, pixel by pixel and word by word; what it refuses
	@tools/setup.sh test-view
	@/usr/bin/python3 tests/view/view.py --view $(VIEW) --host-sim $(BUILD)/view/sim/host_sim --frames frames \
	  --work $(BUILD)/test_view

export: sim ## what is found in FRAMES=DIR for Foxglove and Rerun (MCAP) and spreadsheets (CSV): build/export
	@tools/setup.sh export
	@./host_sim --json --trace $(BUILD)/export/trace $(FRAMES) > $(BUILD)/export/records.jsonl
	@tools/export/isohead-export $(BUILD)/export/records.jsonl --csv $(BUILD)/export/records.csv \
	  --mcap $(BUILD)/export/frames.mcap --frames $(FRAMES) --trace $(BUILD)/export/trace/$(notdir $(FRAMES:/=))

python: sim ## build the Python package's wheel (build/python/dist), install it in a venv, test it against host_sim
	@tools/setup.sh python
	@/usr/bin/python3 -m venv --system-site-packages --clear $(BUILD)/python/venv
	@$(PYTHON_PIP) install --no-deps --require-hashes --only-binary :all: --requirement python/requirements.txt
	@rm -rf $(BUILD)/python/dist
	@$(PYTHON_PIP) wheel --no-deps --no-build-isolation --wheel-dir $(BUILD)/python/dist .
	@$(PYTHON_PIP) install --no-deps --force-reinstall $(BUILD)/python/dist/isohead-*.whl
	@HOST_SIM=$(abspath $(BUILD))/host/sim/host_sim FRAMES=$(abspath frames) \
	  $(BUILD)/python/venv/bin/python -B -m pytest --quiet -p no:cacheprovider python/tests

people: ## frames of people of true anatomy: KIND=hands RIG=paper SEED=1 OUT=DIR (docs/people.md)
	@tools/setup.sh people
	@/usr/bin/python3 tools/people/make.py --rig $(RIG) --kind $(KIND) --seed $(SEED) $(OUT)

board: ## build isohead_board for ARCH=arm64 (default), armhf or host: build/board-ARCH/firmware/app
	@tools/setup.sh board $(ARCH)
	@cmake --preset board-$(ARCH) > $(BUILD)/board-$(ARCH).log 2>&1 || { cat $(BUILD)/board-$(ARCH).log; exit 1; }
	@cmake --build --preset board-$(ARCH) --parallel 2 --target isohead_board

# The same for arm64 with libgpiod 2, which Debian 12 does not have.
board-gpiod2:
	@tools/setup.sh board arm64
	@cmake --preset board-arm64-gpiod2 -DISOHEAD_GPIOD2_DIR=$(abspath $(GPIOD2_DIR)) \
	  > $(BUILD)/board-arm64-gpiod2.log 2>&1 || { cat $(BUILD)/board-arm64-gpiod2.log; exit 1; }
	@cmake --build --preset board-arm64-gpiod2 --parallel 2 --target isohead_board

deb: board ## the Debian package of isohead_board for ARCH=arm64 (default) or armhf: build/*.deb
	@tools/setup.sh deb $(ARCH)
	@tools/board/deb.sh $(ARCH)

deb-tools: calibrate ## the Debian package isohead-tools for this machine: calibrate, host_sim, render, rigblob
	@tools/setup.sh deb tools
	@tools/board/deb.sh tools

test-deb: sim ## build all Debian packages; install, run, update, purge one; its unit under systemd
	@tools/setup.sh test-deb
	@$(MAKE) calibrate
	@$(MAKE) board ARCH=arm64
	@$(MAKE) board ARCH=armhf
	@tests/board/get.sh
	@tests/board/deb.sh frames/sequence1/rig.json

test-board: sim ## isohead_board on an emulated ARM board: frames, faults, signals and the laser's line
	@tools/setup.sh test-board
	@$(MAKE) board ARCH=arm64
	@$(MAKE) board-gpiod2
	@tests/board/get.sh
	@/usr/bin/python3 tests/board/test_board.py --program $(BUILD)/board-arm64/firmware/app/isohead_board \
	  --program2 $(BUILD)/board-arm64-gpiod2/firmware/app/isohead_board --sysroot $(BUILD)/sysroot/arm64 --host-sim $(BUILD)/host/sim/host_sim \
	  --render $(BUILD)/host/tools/render/render --board $(BUILD)/board

# What an image is for: boards with UEFI, or a Raspberry Pi.
IMAGE_OUT = $(BUILD)/image$(if $(filter rpi,$(BOARD)),-rpi)
# The newer kernel of a Raspberry Pi's image does not know the interface of libgpiod 1 any more.
IMAGE_PROGRAM = $(BUILD)/board-arm64$(if $(filter rpi,$(BOARD)),-gpiod2)/firmware/app/isohead_board
image test-image: BOARD ?= uefi
image: ## the image to flash for arm64, BOARD=uefi or rpi: build/image/ or build/image-rpi/isohead.img; XZ=1 packs it too
	@tools/setup.sh image $(BOARD)
	@$(MAKE) $(if $(filter rpi,$(BOARD)),board-gpiod2,board ARCH=arm64)
	@tools/image/image.sh $(BOARD) $(IMAGE_PROGRAM) $(IMAGE_OUT)

flash: ## write IMAGE (default isohead.img of BOARD, as for image) to the disk DEVICE=/dev/..., and read it back
	@tools/setup.sh flash
	@tools/image/flash.sh "$(DEVICE)" $(or $(IMAGE),$(IMAGE_OUT)/isohead.img)

test-image: sim image test-image-$(if $(filter rpi,$(BOARD)),rpi,uefi) ## boot the image of BOARD on an emulated board; failed updates and slots; what flash refuses; BOARD=rpi QUICK=1: U-Boot alone

test-image-rpi: sim image
	@tools/setup.sh test-image rpi
	@/usr/bin/python3 tests/board/image_rpi.py --image $(IMAGE_OUT) --frames frames/sequence2 \
	  --host-sim $(BUILD)/host/sim/host_sim --work $(BUILD)/test_image_rpi $(if $(QUICK),choice loader)

test-image-uefi: sim image
	@tools/setup.sh test-image uefi
	@tests/board/get.sh
	@tests/board/flash.sh $(BUILD)/test_flash
	@/usr/bin/python3 tests/board/image.py --image $(BUILD)/image --board $(BUILD)/board \
	  --program $(BUILD)/board-arm64/firmware/app/isohead_board --frames frames/sequence2 \
	  --host-sim $(BUILD)/host/sim/host_sim --work $(BUILD)/test_image

calibrate: sim ## build tools/calibrate, from pictures of a board to rig.json: build/calibrate/tools/calibrate/calibrate
	@tools/setup.sh calibrate
	@cmake --preset calibrate > $(BUILD)/calibrate.log 2>&1 || { cat $(BUILD)/calibrate.log; exit 1; }
	@cmake --build --preset calibrate --parallel 2

test-calibration: calibrate ## calibrate five rendered rigs, compare with the truth; what is refused; ten minutes
	@/usr/bin/python3 tests/calibration/calibration.py --calibrate $(BUILD)/calibrate/tools/calibrate/calibrate \
	  --render $(BUILD)/calibrate/tools/render/render --host-sim $(BUILD)/calibrate/sim/host_sim \
	  --undistort $(BUILD)/calibrate/tests/calibration/test_undistort \
	  --fake-camera $(BUILD)/calibrate/tests/calibration/libfake_camera.so --work $(BUILD)/test_calibration

test-calibration-short: calibrate ## one of these rigs
	@ctest --test-dir $(BUILD)/calibrate/tests/calibration --output-on-failure

format: ## clang-format over all C and C++ sources
	@tools/setup.sh format
	@git ls-files '*.c' '*.h' '*.cpp' '*.hpp' | xargs clang-format -i

formatted: ## fail when make format would change something
	@tools/setup.sh format
	@git ls-files '*.c' '*.h' '*.cpp' '*.hpp' | xargs clang-format --dry-run --Werror

words: ## old words of our own in names, comments, messages and documents, and the field's words for them
	@/usr/bin/python3 tests/checks/words.py

layout: ## files of at most 520 lines, vectors in simd alone, at most 1,000 files
	@/usr/bin/python3 tests/checks/layout.py

links: ## links and names of files in the documents lead somewhere
	@/usr/bin/python3 tests/checks/links.py

lint: sanitize words layout links ## clang-tidy, cppcheck, MISRA C, gcc -fanalyzer; what they may find: docs/misra.md
	@tools/setup.sh lint
	@/usr/bin/python3 tests/checks/static.py $(BUILD)/sanitize
	@/usr/bin/python3 tests/checks/lint_commands.py $(BUILD)/sanitize $(BUILD)/lint
	@git ls-files 'firmware/*.c' 'hal/*.c' 'sim/*.c' 'tools/*.c' ':!tools/size' ':!tools/bench/worst_count.c' ':!tools/people/cast_points.c' | \
	  xargs -P 2 -n 1 clang-tidy --quiet -p $(BUILD)/lint 2> $(BUILD)/lint.log || \
	  { grep -v 'warnings* generated' $(BUILD)/lint.log; exit 1; }
	@cmake --preset lint-tools > $(BUILD)/lint.log 2>&1 || { cat $(BUILD)/lint.log; exit 1; }
	@git ls-files 'tools/common/*.cpp' 'tools/calibrate/*.cpp' 'tools/view/*.cpp' 'tests/calibration/*.cpp' | \
	  xargs -P 2 -n 1 clang-tidy --quiet -p $(BUILD)/lint-tools 2> $(BUILD)/lint.log || \
	  { grep -v 'warnings* generated' $(BUILD)/lint.log; exit 1; }

# A test that was killed may have left a file system mounted below the build: never into that.
clean: ## remove the build; rendered frames stay
	@rm -rf --one-file-system $(BUILD)
