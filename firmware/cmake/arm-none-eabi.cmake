# For CMAKE_TOOLCHAIN_FILE: Cortex-M4 without its floating-point unit, by gcc or, with -D DCMP_COMPILER=clang, by clang.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-m4)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES DCMP_COMPILER)

set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mthumb -mfloat-abi=soft")
if(DCMP_COMPILER STREQUAL "clang")
  set(CMAKE_C_COMPILER clang)
  set(CMAKE_C_COMPILER_TARGET armv7em-none-eabi)
else()
  set(CMAKE_C_COMPILER arm-none-eabi-gcc)
endif()
