# Exports .glb files with HOLDFAST and has the Khronos validator (npm) judge them, in WORK_DIR.
find_program(node node)
find_program(npm npm)
if(NOT node OR NOT npm)
  message("SKIPPED: node and npm are needed for the glTF validator")
  return()
endif()
file(MAKE_DIRECTORY ${WORK_DIR})
foreach(name package.json package-lock.json validate_gltf.mjs)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/${name} ${WORK_DIR}/${name} COPYONLY)
endforeach()
file(SHA256 ${WORK_DIR}/package-lock.json lock)
if(NOT EXISTS ${WORK_DIR}/installed-${lock})
  execute_process(COMMAND ${npm} ci --no-audit --no-fund WORKING_DIRECTORY ${WORK_DIR}
                  RESULT_VARIABLE failed OUTPUT_QUIET ERROR_QUIET TIMEOUT 120)
  if(failed)
    message("SKIPPED: npm could not install the glTF validator (no network?)")
    return()
  endif()
  file(TOUCH ${WORK_DIR}/installed-${lock})
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
