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

set(PROGRAM soc/stm32f4/bench/bench.c soc/stm32f4/bench/vectors.c)
set(SETTINGS soc/stm32f4/bench/settings.c)

# The program of the board that board_read has read.
function(dcmp_board folder)
  set(name ${BOARD_NAME})
  set(drivers ${SOC_SOURCES})
  if(BOARD_SOURCES)
    set(sources ${BOARD_SOURCES} ${SETTINGS} boards/native/plant_port.c)
    list(FILTER drivers EXCLUDE REGEX "bxcan|quadrature") # of pins that its board.h does not have
  else()
    set(sources ${PROGRAM} ${SETTINGS} soc/stm32f4/amplifier_${BOARD_AMPLIFIER}.c)
  endif()
  if(DCMP_COMPILER STREQUAL "clang")
    add_library(${name} OBJECT ${sources} ${drivers} ${APP_SOURCES})
    target_include_directories(${name} PRIVATE core)
  else()
    add_executable(${name} ${sources} ${drivers} ${APP_SOURCES})
    set_target_properties(${name} PROPERTIES SUFFIX .elf LINK_DEPENDS ${LINKER_SCRIPT})
    target_link_options(${name} PRIVATE -nostdlib -nostartfiles -Wl,--defsym=FLASH_KIB=${BOARD_FLASH_KIB}
                        -Wl,--defsym=RAM_KIB=${BOARD_RAM_KIB} -T${LINKER_SCRIPT} -Wl,--gc-sections
                        -Wl,--fatal-warnings -Wl,--print-memory-usage -Wl,-Map=${name}.map)
    target_link_libraries(${name} PRIVATE core gcc)
    # Two pieces for flashing, with the board's record between them, and one image of both for an empty chip.
    add_custom_command(
      TARGET ${name} POST_BUILD
      COMMAND ${CMAKE_OBJCOPY} -O binary -j .vectors $<TARGET_FILE:${name}> ${name}.vectors.bin
      COMMAND ${CMAKE_OBJCOPY} -O binary -R .vectors $<TARGET_FILE:${name}> ${name}.code.bin
      COMMAND ${CMAKE_OBJCOPY} -O binary --gap-fill 0xFF -R .stack -R .bss -R .noinit $<TARGET_FILE:${name}> ${name}.bin)
  endif()
  target_include_directories(${name} PRIVATE ${folder} app soc/stm32f4 soc/stm32f4/bench)
  if(BOARD_SOURCES)
    target_include_directories(${name} PRIVATE boards/native) # the plant port
  endif()
endfunction()

include(cmake/boards.cmake)
set(DCMP_BOARDS ${CMAKE_CURRENT_SOURCE_DIR}/boards CACHE PATH "the folder with a folder for each board")
file(GLOB BOARD_FILES CONFIGURE_DEPENDS ${DCMP_BOARDS}/*/board.h)
if(NOT BOARD_FILES)
  message(FATAL_ERROR "No board is in ${DCMP_BOARDS}. Give a folder that has NAME/board.h: -D DCMP_BOARDS=FOLDER")
endif()
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${BOARD_FILES})
foreach(file IN LISTS BOARD_FILES)
  get_filename_component(folder ${file} DIRECTORY)
  board_read(${folder})
  dcmp_board(${folder})
endforeach()
