# Exports .glb files with HOLDFAST and has the Khronos validator (npm) judge them, in WORK_DIR.
include(${CMAKE_CURRENT_LIST_DIR}/npm_install.cmake)
holdfast_npm_install(node validate_gltf.mjs)
if(NOT node)
  return()
endif()
foreach(arguments "fit demo_drink mug -o held" "export held -o held.glb"
                  "export held -o plain.glb --no-correctives --no-object"
                  "export demo_inspect -o short.glb --start 7 --end 8")
  separate_arguments(words UNIX_COMMAND "${arguments} --force --quiet")
  execute_process(COMMAND ${HOLDFAST} ${words} WORKING_DIRECTORY ${WORK_DIR} OUTPUT_QUIET
                  COMMAND_ERROR_IS_FATAL ANY)
endforeach()
execute_process(COMMAND ${node} validate_gltf.mjs held.glb plain.glb short.glb
                WORKING_DIRECTORY ${WORK_DIR} COMMAND_ERROR_IS_FATAL ANY)
