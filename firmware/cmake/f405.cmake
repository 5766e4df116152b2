# What only the target has: no library but the compiler's own, every function and object in a section of its own. The
# compiler must not take memcpy's loop for a call of memcpy.
set(CMAKE_C_FLAGS_RELEASE "-O2 -g")
add_compile_options(-ffreestanding -ffunction-sections -fdata-sections)
if(NOT DCMP_COMPILER STREQUAL "clang")
  add_compile_options(-fno-tree-loop-distribute-patterns -fstack-usage)
endif()

file(GLOB SOC_SOURCES CONFIGURE_DEPENDS soc/stm32f4/*.c)
list(FILTER SOC_SOURCES EXCLUDE REGEX amplifier_)
file(GLOB APP_SOURCES CONFIGURE_DEPENDS app/*.c)
set(LINKER_SCRIPT ${CMAKE_CURRENT_SOURCE_DIR}/soc/stm32f4/stm32f405.ld)

function(dcmp_board name)
  if(DCMP_COMPILER STREQUAL "clang")
    add_library(${name} OBJECT ${ARGN} ${SOC_SOURCES} ${APP_SOURCES})
    target_include_directories(${name} PRIVATE core)
  else()
    add_executable(${name} ${ARGN} ${SOC_SOURCES} ${APP_SOURCES})
    set_target_properties(${name} PROPERTIES SUFFIX .elf LINK_DEPENDS ${LINKER_SCRIPT})
    target_link_options(${name} PRIVATE -nostdlib -nostartfiles -T${LINKER_SCRIPT} -Wl,--gc-sections
                        -Wl,--fatal-warnings -Wl,--print-memory-usage -Wl,-Map=${name}.map)
    target_link_libraries(${name} PRIVATE core gcc)
    # Two pieces for flashing, with the board's record between them, and one image of both for an empty chip.
    add_custom_command(
      TARGET ${name} POST_BUILD
      COMMAND ${CMAKE_OBJCOPY} -O binary -j .vectors $<TARGET_FILE:${name}> ${name}.vectors.bin
      COMMAND ${CMAKE_OBJCOPY} -O binary -R .vectors $<TARGET_FILE:${name}> ${name}.code.bin
      COMMAND ${CMAKE_OBJCOPY} -O binary --gap-fill 0xFF -R .stack -R .bss -R .noinit $<TARGET_FILE:${name}> ${name}.bin)
  endif()
  target_include_directories(${name} PRIVATE app soc/stm32f4 boards/f405)
endfunction()

set(BENCH boards/bench_f405/board.c boards/bench_f405/vectors.c boards/f405/settings.c)
dcmp_board(bench_f405_dac ${BENCH} soc/stm32f4/amplifier_dac.c)
dcmp_board(bench_f405_pwm ${BENCH} soc/stm32f4/amplifier_pwm.c)
set(CRYSTAL_HZ 8000000 CACHE STRING "of the board's crystal; 2 MHz has to divide it")
target_compile_definitions(bench_f405_dac PRIVATE BOARD_NUMBER=3 BOARD_CRYSTAL_HZ=${CRYSTAL_HZ}u)
target_compile_definitions(bench_f405_pwm PRIVATE BOARD_NUMBER=5 BOARD_CRYSTAL_HZ=${CRYSTAL_HZ}u)

dcmp_board(qemu_f405 boards/qemu_f405/board.c boards/qemu_f405/vectors.c boards/f405/settings.c
           boards/native/plant_port.c)
target_include_directories(qemu_f405 PRIVATE boards/native)
target_compile_definitions(qemu_f405 PRIVATE BOARD_CRYSTAL_HZ=8000000u)
