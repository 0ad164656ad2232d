# Writes OUT, which tells programs the commit of SOURCE: cmake -DSOURCE=DIR -DOUT=FILE -P commit.cmake
# Sources without git, such as those of a Debian package, have none. The file is written only if it changes.
cmake_minimum_required(VERSION 3.18)
set(commit "")
find_program(GIT git)
if(GIT AND EXISTS ${SOURCE}/.git)
  execute_process(COMMAND ${GIT} -C ${SOURCE} describe --always --dirty=\ with\ changes --exclude=* --abbrev=10
    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
set(text "#pragma once\n#define SLENDER_COMMIT \"${commit}\"\n")
set(before "")
if(EXISTS ${OUT})
  file(READ ${OUT} before)
endif()
if(NOT text STREQUAL before)
  file(WRITE ${OUT} "${text}")
endif()
