set_target_properties(core PROPERTIES POSITION_INDEPENDENT_CODE ON C_VISIBILITY_PRESET hidden)

add_library(hostlib SHARED boards/hostlib/hostlib.c)
target_link_libraries(hostlib PRIVATE core)
set_target_properties(hostlib PROPERTIES OUTPUT_NAME dcmp C_VISIBILITY_PRESET hidden)

add_executable(native boards/native/native.c boards/native/plant_port.c boards/native/pty.c)
target_compile_definitions(native PRIVATE _XOPEN_SOURCE=700)
target_link_libraries(native PRIVATE core)
set_target_properties(native PROPERTIES OUTPUT_NAME dcmp-native)
