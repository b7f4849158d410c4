# Installs BUILD_DIR and builds and runs the project in CONSUMER_DIR against it.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "failed: ${ARGN}")
  endif()
endfunction()

set(prefix ${BUILD_DIR}/consumer/prefix)
file(REMOVE_RECURSE ${BUILD_DIR}/consumer)
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})
run(${CMAKE_COMMAND} -S ${CONSUMER_DIR} -B ${BUILD_DIR}/consumer/build -G ${GENERATOR}
    -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${BUILD_DIR}/consumer/build)
execute_process(COMMAND ${BUILD_DIR}/consumer/build/consumer RESULT_VARIABLE failed
                WORKING_DIRECTORY ${BUILD_DIR}/consumer/build)
if(failed)
  message(FATAL_ERROR "the consumer failed")
endif()
run(${prefix}/bin/holdfast score ${BUILD_DIR}/consumer/build/held.npz --object mug)
run(${prefix}/bin/holdfast --version)
