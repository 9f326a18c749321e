# make            build every program into build/
# make demo       pictures of a real scene in build/demo/
# make demo-sequence  a moving camera and a moving thing through the denoiser, in build/demo-sequence
# make test       every test; make suites: only the cmocka suites, make determinism: only the golden hashes
# make strict     every language standard, compiler, target and optimisation level, warnings as errors
# make bench      error against run time, beside other methods, into build/bench/ and docs/; QUICK=1: a look in five minutes
# make specular   that part of make bench which is about specular occlusion: docs/specular.md and its pictures
# make bench-frames  that part of it which is about frames: docs/frames.md, docs/viewer.md
# make bench-performance  ... about where the time goes: docs/performance.md, docs/tuning.md
# make bench-bake  tables of docs/baking.md; LARGE=1: also 8192 x 8192 in 512 MiB. make bench-gis: beside SAGA GIS
# make fuzz       libFuzzer for FUZZ_SECONDS (60); make msan: golden hashes and the corpus under MemorySanitizer
# make port-docs  the tables and the picture of docs/porting.md
# make golden     rewrite tests/data/golden.txt (after a deliberate change of the results)
# make figures    docs/figures/*.gp to svg, and the pictures in README and docs/ from the demos and the viewer
# make format, make check-format, make coverage, make clean
#
# config=debug|release|sanitize|thread|coverage chooses the flags; objects of each are kept apart.

config ?= release
FUZZ_SECONDS ?= 60
CC = gcc

# V=1 shows the commands.
Q := $(if $(V),,@)
say = @$(if $(V)$(findstring s,$(firstword -$(MAKEFLAGS))),:,echo '$(1)')

# Use every core unless the caller chose a number of jobs.
ifeq ($(filter -j%,$(MAKEFLAGS)),)
MAKEFLAGS += -j$(shell nproc)
endif

flags_debug := -O0 -g
flags_release := -O2
flags_sanitize := -O1 -g -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all -fno-omit-frame-pointer
flags_thread := -O1 -g -fsanitize=thread
flags_coverage := -O0 -g --coverage
ifeq ($(flags_$(config)),)
$(error config=$(config): not one of debug, release, sanitize, thread, coverage)
endif

warnings := -Wall -Wextra -Wpedantic -Wshadow -Wundef -Wconversion -Wsign-conversion -Wdouble-promotion -Werror
# Contraction to fused multiply-adds would give different bits on different machines.
cflags := -std=c99 -D_POSIX_C_SOURCE=200809L $(warnings) -ffp-contract=off $(flags_$(config)) -I. -Iexamples/common -pthread $(CFLAGS)
libs := -lm
exr_libs := -lOpenEXRCore
# Optional packages, looked for when a recipe runs, since tests/setup.sh may just have installed them.
hash := \#
has_header = $(shell echo '$(hash)include <$(1)>' | $(CC) -E -x c - >/dev/null 2>&1 && echo yes)
raster_libs = $(if $(call has_header,png.h),-lpng) $(if $(call has_header,tiffio.h),-ltiff)
obj := build/obj/$(config)

# ---- what there is --------------------------------------------------------------------------------------------------

has_main = $(if $(1),$(shell grep -l '^int main' $(1)))

examples := $(filter-out examples/bake_mpi.c,$(wildcard examples/*.c))
benches := $(call has_main,$(wildcard tests/bench/*.c))
all_suites := $(wildcard tests/unit/test_*.c tests/reference/test_*.c)
# SUITES=test_api limits what is built and run to the suites named.
suites := $(if $(SUITES),$(foreach s,$(SUITES),$(filter %/$(s).c,$(all_suites))),$(all_suites))
common := $(wildcard examples/common/*.c)
reference := $(filter-out tests/reference/test_%,$(wildcard tests/reference/*.c))
bench_common := $(filter-out $(benches),$(wildcard tests/bench/*.c tests/bench/rivals/*.c))

# build/demo and build/bench are directories of what the programs of that name write.
program_of = $(patsubst build/demo,build/demo-sheet,$(patsubst build/bench,build/bench-run,build/$(basename $(notdir $(1)))))
programs := $(foreach f,$(examples),$(call program_of,$(f)))
bench_programs := $(foreach f,$(benches),$(call program_of,$(f)))
suite_programs := $(foreach f,$(suites),build/tests/$(basename $(notdir $(f))))
objects = $(patsubst %.c,$(obj)/%.o,$(1))

.PHONY: all bake-mpi port port-docs bench-bake bench-frames bench-performance bench-gis demo demo-sequence test suites determinism golden instructions instructions-record strict bench specular fuzz msan figures \
    format check-format coverage clean FORCE
.DELETE_ON_ERROR:
.PRECIOUS: build/setup/%
all: $(programs) bake-mpi port

# ---- objects --------------------------------------------------------------------------------------------------------

# Packages a part of the build needs; before any compiling, so that no header is missing.
build/setup/%: tests/setup.sh
	@tests/setup.sh $* $(if $(filter viewer,$*),|| echo 'build/viewer: without a window')
	@mkdir -p $(@D) && touch $@

# Files that change only when their text does: recompile on other flags, relink on another configuration.
$(obj)/flags: text = $(CC) $(cflags)
build/obj/config: text = $(config)
$(obj)/flags build/obj/config: FORCE
	@mkdir -p $(@D)
	@echo '$(text)' | cmp -s - $@ || echo '$(text)' > $@

$(obj)/%.o: %.c $(obj)/flags | build/setup/build build/setup/bake
	@mkdir -p $(@D)
	$(call say,compile $<)
	$(Q)$(CC) $(cflags) -MMD -MP -c $< -o $@

$(call objects,$(suites)): | build/setup/test
$(call objects,$(benches) $(bench_common)): | build/setup/bench
# The straight transcription that timings are compared with gets the best of the compiler.
$(call objects,$(benches) $(bench_common)): private cflags += -O3 -march=native

# As archives, so that a program takes only what it uses (and minimal.c can bring its own implementation).
$(obj)/common.a: $(call objects,$(common))
$(obj)/reference.a: $(call objects,$(reference))
$(obj)/bench.a: $(call objects,$(bench_common))
$(obj)/%.a:
	@mkdir -p $(@D)
	@rm -f $@ && ar rcs $@ $^

-include $(patsubst %.o,%.d,$(call objects,$(examples) examples/bake_mpi.c $(wildcard examples/port/*.c) $(benches) $(suites) $(common) $(reference) $(bench_common)))

# ---- programs -------------------------------------------------------------------------------------------------------

# $(call program,PROGRAM,SOURCE,ARCHIVES,LIBRARIES)
define program
$(1): $(call objects,$(2)) $(3) build/obj/config
	@mkdir -p $$(@D)
	$$(call say,link $$@)
	$$(Q)$$(CC) $$(cflags) $(call objects,$(2)) $(3) -Wl,--as-needed $(4) $$(libs) -o $$@
endef

$(call objects,examples/common/raster3d.c examples/common/render.c): private cflags += $(if $(filter release,$(config)),-O3)
# Without SDL2 the viewer is built without a window.
$(call objects,examples/viewer.c): | build/setup/viewer
sdl_libs = $(if $(wildcard /usr/include/SDL2/SDL.h),-lSDL2)
$(foreach f,$(examples),$(eval $(call program,$(call program_of,$(f)),$(f),$(obj)/common.a,\
  $(exr_libs) $$(raster_libs) $(if $(filter examples/viewer.c,$(f)),$$(sdl_libs)))))
$(foreach f,$(suites),\
  $(eval $(call program,build/tests/$(basename $(notdir $(f))),$(f),$(obj)/reference.a $(obj)/common.a,$(exr_libs) $$(raster_libs) -lcmocka)))
$(foreach f,$(benches),\
  $(eval $(call program,$(call program_of,$(f)),$(f),$(obj)/bench.a $(obj)/reference.a $(obj)/common.a,$(exr_libs) -lembree3)))

# Only where MPI is installed. Its headers are the system's: no warnings of ours in them.
mpi_flags = $(patsubst -I%,-isystem %,$(shell mpicc --showme:compile 2>/dev/null))
bake-mpi: $(programs) | build/setup/bake
	@if command -v mpicc >/dev/null; then env -u MAKEFLAGS -u MFLAGS $(MAKE) --no-print-directory \
	config='$(config)' CC='$(CC)' CFLAGS='$(CFLAGS)' V='$(V)' build/bake-mpi; \
	else echo 'build/bake-mpi: left out, there is no mpicc'; fi

$(call objects,examples/bake_mpi.c): private cflags += $(mpi_flags)
$(eval $(call program,build/bake-mpi,examples/bake_mpi.c,$(obj)/common.a,$(exr_libs) $$(raster_libs) $$(shell mpicc --showme:link)))

# The shaders, and the host that runs them, only where glslang and Vulkan's headers are installed.
shader_sources := $(wildcard examples/shaders/*.hlsl)
shaders := $(foreach f,$(basename $(notdir $(shader_sources))),build/shaders/$(f).spv build/shaders/half/$(f).spv)
glslang := glslangValidator --quiet -D -V -S comp -e main --hlsl-enable-16bit-types --shift-ssbo-binding 1
build/shaders/%.spv: examples/shaders/%.hlsl $(wildcard examples/shaders/*.hlsli)
	@mkdir -p $(@D)
	$(call say,glslang $<)
	$(Q)$(glslang) $< -o $@
build/shaders/half/%.spv: examples/shaders/%.hlsl $(wildcard examples/shaders/*.hlsli)
	@mkdir -p $(@D)
	$(call say,glslang $@)
	$(Q)$(glslang) -DHALF=1 $< -o $@

has_port = $(and $(shell command -v glslangValidator),$(call has_header,vulkan/vulkan.h))
port_objects := $(call objects,examples/port/gpu.c examples/port/stages.c)
$(obj)/port.a: $(port_objects)
$(port_objects) $(call objects,examples/port/port.c): | build/setup/port
port: build/ao | build/setup/port
	@if [ '$(if $(has_port),yes)' ]; then env -u MAKEFLAGS -u MFLAGS $(MAKE) --no-print-directory \
	config='$(config)' CC='$(CC)' CFLAGS='$(CFLAGS)' V='$(V)' build/port-all; \
	else echo 'build/port: left out, there is no glslangValidator or no vulkan/vulkan.h'; fi

.PHONY: build/port-all
build/port-all: build/port $(shaders)
	@:
$(eval $(call program,build/port,examples/port/port.c,$(obj)/port.a $(obj)/common.a,-lvulkan $(exr_libs) $$(raster_libs)))

# ---- what to do with them -------------------------------------------------------------------------------------------

demo: build/demo-sheet
	build/demo-sheet

# The animation runs at 10 frames a second, every third one of the sequence's.
demo-sequence: build/sequence | build/setup/sequence
	build/sequence build/demo-sequence
	gnuplot examples/sequence.gp > build/demo-sequence/error.svg
	apngasm build/demo-sequence/sequence.png build/demo-sequence/frame000.png 1 10 -z0 > /dev/null
	@echo 'build/demo-sequence: sequence.png, strip.png, error.svg, error.txt'

# QUICK=1: small images and few settings into build/bench/; otherwise also the figures and tables that docs/ shows.
bench: $(bench_programs) build/lut build/tests/test_specular build/viewer build/sequence | build/setup/figures
	build/bench-run $(if $(QUICK),--quick)
	build/bench_thickness $(if $(QUICK),--quick)
	build/bench_multibounce $(if $(QUICK),--size 120x68 --paths 50,--size 240x135 --paths 200) > build/bench/multibounce.txt
	build/bench_directional $(if $(QUICK),--size 120x68 --rays 144) > build/bench/directional.txt
	build/bench_sweep $(if $(QUICK),--quick) > build/bench/sweep.txt
	tests/bench/publish.sh $(if $(QUICK),,docs)
	tests/bench/specular.sh $(if $(QUICK),--quick,docs)
	tests/bench/frames.sh $(if $(QUICK),--quick,docs)
	tests/bench/performance.sh $(if $(QUICK),--quick,docs)

# Only the part of it that is about frames: docs/frames.md, docs/viewer.md.
bench-frames: build/bench_frames build/viewer build/sequence
	tests/bench/frames.sh $(if $(QUICK),--quick,docs)

# Only the part of it that is about where the time goes: docs/performance.md, docs/tuning.md. Needs docs/benchmark.md.
bench-performance: build/bench-run build/bench_growth build/bench_memory build/bench_effort | build/setup/figures
	tests/bench/performance.sh $(if $(QUICK),--quick,docs)

# Only the part of it that is about specular occlusion.
specular: build/bench_shading build/bench_specular build/lut build/tests/test_specular
	tests/bench/specular.sh $(if $(QUICK),--quick,docs)

bench-bake: build/bake build/bake_bench bake-mpi
	tests/bench/bake.sh

bench-gis: build/bake build/bake_bench | build/setup/gis
	tests/bench/gis.sh

test: $(suite_programs) $(programs) bake-mpi port | build/setup/test
	@tests/run.sh $(suite_programs) tests/docs.sh tests/determinism.sh tests/instructions.sh

suites: $(suite_programs) $(programs) bake-mpi port
	@tests/run.sh $(suite_programs)

determinism: | build/setup/test
	@tests/run.sh tests/determinism.sh

golden: | build/setup/test
	tests/determinism.sh --write

instructions: | build/setup/test
	@tests/run.sh tests/instructions.sh

instructions-record: | build/setup/test
	tests/instructions.sh --write

strict: | build/setup/strict build/setup/bench
	@tests/run.sh tests/strict/strict.sh

fuzz: | build/setup/fuzz
	@tests/fuzz/fuzz.sh $(FUZZ_SECONDS)

msan: | build/setup/fuzz
	@tests/run.sh tests/fuzz/msan.sh

figures: demo demo-sequence build/viewer build/bake build/mesh_to_map | build/setup/figures
	cp build/demo/strip.png docs/figures/demo.png
	cp build/demo-sequence/error.svg docs/figures/sequence.svg
	cp build/demo-sequence/frame034.png docs/figures/sequence.png
	build/viewer --size 1120x630 --frames 40 --screenshot docs/figures/viewer.png
	build/bake --height tests/data/jacksboro.pfm --pixel-size 75,92 --height-scale 3 -o build/demo/ao.pfm \
	  --bent build/demo/bent.pfm --picture docs/figures/bake_terrain.png
	build/mesh_to_map --size 384 --height build/demo/mh.exr --normal build/demo/mn.exr
	build/bake --height build/demo/mh.exr --normal build/demo/mn.exr --pixel-size 0.00270833331 --no-data nan \
	  -o build/demo/ao.pfm --bent build/demo/bent.pfm --picture docs/figures/bake_mesh.png
	@for f in docs/figures/*.gp; do echo "gnuplot $$f" && gnuplot $$f > $${f%.gp}.svg || exit 1; done

port-docs: build/ao build/diff build/replay build/mesh_to_map port
	tests/port/figures.sh docs

sources := $(wildcard *.h examples/*.[ch] examples/common/*.[ch] examples/port/*.[ch] tests/*/*.[ch])
format: | build/setup/format
	clang-format -i $(sources) && clang-format -i $(sources) # once is not always enough

check-format: | build/setup/format
	@clang-format --dry-run -Werror $(sources) && echo '1 passed, 0 failed'

coverage:
	@find build/obj/coverage -name '*.gcda' -delete 2>/dev/null || true
	@$(MAKE) --no-print-directory config=coverage suites
	@find build/obj/coverage -name 'gtao_impl.gcda' -exec gcov -n {} + | grep -A1 "gtao.h'"

clean:
	rm -rf build
