# WSTac for CMake. ci/build libwstac and ci/build libwstac-fw install this file with the libraries that it finds beside itself.
#
#   find_package(wstac REQUIRED)                  wstac::wstac   libwstac.so, for programs on a host
#   find_package(wstac REQUIRED COMPONENTS fw)    wstac::fw      libwstac_fw.a, for firmware
#
# Without components, every library that is there for the target becomes a target of CMake. The firmware's library is
# that of the compiler's processor and floating-point ABI. wstac_TARGET, if it is set, names another one, as Rust names its
# targets:
#
#   cmake -Dwstac_TARGET=thumbv7em-none-eabihf …

get_filename_component(_wstac_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." REALPATH)
set(_wstac_missing "")

# Sets `result` to the Rust target that the compiler compiles for, by its macros; empty if it is unknown.
function(_wstac_find_target result)
    set(${result} "" PARENT_SCOPE)
    set(language C)
    if(NOT CMAKE_C_COMPILER)
        set(language CXX)
    endif()
    separate_arguments(flags UNIX_COMMAND "${CMAKE_${language}_COMPILER_ARG1} ${CMAKE_${language}_FLAGS}")
    if(CMAKE_${language}_COMPILER_TARGET)
        list(APPEND flags "--target=${CMAKE_${language}_COMPILER_TARGET}")
    endif()
    set(empty "${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/wstac-empty.c")
    file(WRITE "${empty}" "")
    execute_process(COMMAND "${CMAKE_${language}_COMPILER}" ${flags} -dM -E "${empty}"
        OUTPUT_VARIABLE macros ERROR_QUIET RESULT_VARIABLE failed)
    if(failed)
        return()
    endif()
    if(macros MATCHES "__linux__ ")
        foreach(processor x86_64 aarch64)
            if(macros MATCHES "__${processor}__ ")
                set(${result} "${processor}-unknown-linux-gnu" PARENT_SCOPE)
            endif()
        endforeach()
        return()
    endif()
    set(abi eabi)
    if(macros MATCHES "__ARM_PCS_VFP ")
        set(abi eabihf)
    endif()
    if(macros MATCHES "__ARM_ARCH_6M__ ")
        set(${result} thumbv6m-none-eabi PARENT_SCOPE)
    elseif(macros MATCHES "__ARM_ARCH_7M__ ")
        set(${result} thumbv7m-none-eabi PARENT_SCOPE)
    elseif(macros MATCHES "__ARM_ARCH_7EM__ ")
        set(${result} thumbv7em-none-${abi} PARENT_SCOPE)
    elseif(macros MATCHES "__ARM_ARCH_8M_BASE__ ")
        set(${result} thumbv8m.base-none-eabi PARENT_SCOPE)
    elseif(macros MATCHES "__ARM_ARCH_8M_MAIN__ |__ARM_ARCH_8_1M_MAIN__ ")
        set(${result} thumbv8m.main-none-${abi} PARENT_SCOPE)
    endif()
endfunction()

if(EXISTS "${_wstac_prefix}/lib/libwstac.so" AND NOT CMAKE_CROSSCOMPILING)
    if(NOT TARGET wstac::wstac)
        add_library(wstac::wstac SHARED IMPORTED)
        set_target_properties(wstac::wstac PROPERTIES
            IMPORTED_LOCATION "${_wstac_prefix}/lib/libwstac.so"
            INTERFACE_INCLUDE_DIRECTORIES "${_wstac_prefix}/include")
    endif()
    set(wstac_wstac_FOUND TRUE)
elseif(CMAKE_CROSSCOMPILING)
    set(_wstac_missing_wstac "libwstac.so is for the host, and this build is for another machine")
else()
    set(_wstac_missing_wstac "${_wstac_prefix}/lib has no libwstac.so: ci/build libwstac installs it")
endif()

if(wstac_TARGET)
    set(_wstac_target "${wstac_TARGET}")
else()
    _wstac_find_target(_wstac_target)
endif()
set(_wstac_archive "${_wstac_prefix}/lib/${_wstac_target}/libwstac_fw.a")
if(_wstac_target AND EXISTS "${_wstac_archive}")
    if(NOT TARGET wstac::fw)
        add_library(wstac::fw STATIC IMPORTED)
        set_target_properties(wstac::fw PROPERTIES
            IMPORTED_LOCATION "${_wstac_archive}"
            INTERFACE_INCLUDE_DIRECTORIES "${_wstac_prefix}/include")
    endif()
    set(wstac_fw_FOUND TRUE)
elseif(_wstac_target)
    set(_wstac_missing_fw "${_wstac_archive} is not there: ci/build libwstac-fw installs it for ${_wstac_target}")
else()
    set(_wstac_missing_fw "the compiler's target is unknown: set wstac_TARGET to the Rust target of the library")
endif()

set(wstac_FOUND TRUE)
if(NOT wstac_FIND_COMPONENTS AND NOT wstac_wstac_FOUND AND NOT wstac_fw_FOUND)
    set(wstac_FOUND FALSE)
    set(_wstac_missing "${_wstac_missing_wstac}; ${_wstac_missing_fw}")
endif()
foreach(_wstac_component IN LISTS wstac_FIND_COMPONENTS)
    if(NOT _wstac_component MATCHES "^(wstac|fw)$")
        set(_wstac_missing_${_wstac_component} "it has no component ${_wstac_component}, only wstac and fw")
    endif()
    if(wstac_FIND_REQUIRED_${_wstac_component} AND NOT wstac_${_wstac_component}_FOUND)
        set(wstac_FOUND FALSE)
        set(_wstac_missing "${_wstac_missing_${_wstac_component}}")
    endif()
endforeach()
if(NOT wstac_FOUND)
    set(wstac_NOT_FOUND_MESSAGE "${_wstac_missing}")
endif()
