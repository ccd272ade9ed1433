# Compiles for a Cortex-M4F with Arm's GNU tools. FLOAT_ABI is hard, softfp or soft. The latter two need the library of
# thumbv7em-none-eabi.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-m4)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES FLOAT_ABI)
set(FLOAT_ABI hard CACHE STRING "floating-point ABI: hard, softfp or soft")
set(fpu "")
if(NOT FLOAT_ABI STREQUAL soft)
    set(fpu "-mfpu=fpv4-sp-d16")
endif()
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mthumb ${fpu} -mfloat-abi=${FLOAT_ABI} -ffunction-sections -fdata-sections")
