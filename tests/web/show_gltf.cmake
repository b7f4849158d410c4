# Exports a fitted clip with HOLDFAST as .glb and as a mesh per frame, in WORK_DIR, and has VIEWER
# (blender or three.js) show that they are the same in every frame.
include(${CMAKE_CURRENT_LIST_DIR}/npm_install.cmake)
file(MAKE_DIRECTORY ${WORK_DIR})
if(VIEWER STREQUAL "blender")
  find_program(blender blender)
  if(NOT blender)
    message("SKIPPED: blender (Debian's package) is not installed")
    return()
  endif()
  set(viewer ${blender} -b --factory-startup --python-exit-code 1
             -P ${CMAKE_CURRENT_LIST_DIR}/show_gltf_blender.py --)
else()
  holdfast_npm_install(node show_gltf_three.mjs)
  if(NOT node)
    return()
  endif()
  set(viewer ${node} show_gltf_three.mjs)
endif()
foreach(arguments "fit demo_drink mug -o held --no-report" "export held -o held.glb"
                  "export held -o frame_%04d.ply")
  separate_arguments(words UNIX_COMMAND "${arguments} --force --quiet")
  execute_process(COMMAND ${HOLDFAST} ${words} WORKING_DIRECTORY ${WORK_DIR} OUTPUT_QUIET
                  COMMAND_ERROR_IS_FATAL ANY)
endforeach()
execute_process(COMMAND ${viewer} held.glb WORKING_DIRECTORY ${WORK_DIR} COMMAND_ERROR_IS_FATAL ANY)
