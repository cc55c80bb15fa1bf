# Gives the names that an object keeps for its own relocations alone short ones: they are a twentieth of the archive, and
# nobody sees them.
#
#   cmake -D OBJECT=palpate.o -D RELEASE=1 -D NM=nm -D OBJCOPY=objcopy -P short_names.cmake
if(NOT RELEASE)
  return()
endif()
execute_process(COMMAND ${NM} --defined-only ${OBJECT} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL " [a-z] [^\n]+" locals "${symbols}")
list(TRANSFORM locals REPLACE "^ [a-z] " "")
list(REMOVE_DUPLICATES locals)
set(names "")
set(number 0)
foreach(name IN LISTS locals)
  string(APPEND names "${name} .${number}\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE ${OBJECT}.names "${names}")
execute_process(COMMAND ${OBJCOPY} --redefine-syms=${OBJECT}.names ${OBJECT} COMMAND_ERROR_IS_FATAL ANY)
