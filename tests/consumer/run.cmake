# Installs BUILD_DIR and builds and runs the project in CONSUMER_DIR, and the C++ examples, against it.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "failed: ${ARGN}")
  endif()
endfunction()

set(prefix ${BUILD_DIR}/consumer/prefix)
set(consumer ${BUILD_DIR}/consumer/build)
set(examples ${BUILD_DIR}/consumer/examples)
file(REMOVE_RECURSE ${BUILD_DIR}/consumer)
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})

function(build source binary)
  run(${CMAKE_COMMAND} -S ${source} -B ${binary} -G ${GENERATOR} -DCMAKE_PREFIX_PATH=${prefix}
      -DCMAKE_BUILD_TYPE=Release)
  run(${CMAKE_COMMAND} --build ${binary})
endfunction()

# Runs a program of the examples; what it prints has to match every one of the expressions.
function(run_example program arguments)
  execute_process(COMMAND ${examples}/${program} ${arguments} WORKING_DIRECTORY ${examples}
                  RESULT_VARIABLE failed OUTPUT_VARIABLE printed)
  foreach(expected ${ARGN})
    if(failed OR NOT printed MATCHES "${expected}")
      message(FATAL_ERROR "${program} ${arguments} (${failed}): no '${expected}' in\n${printed}")
    endif()
  endforeach()
endfunction()

build(${CONSUMER_DIR} ${consumer})
execute_process(COMMAND ${consumer}/consumer RESULT_VARIABLE failed WORKING_DIRECTORY ${consumer})
if(failed)
  message(FATAL_ERROR "the consumer failed")
endif()
run(${prefix}/bin/holdfast score ${consumer}/held.npz --object mug)
run(${prefix}/bin/holdfast export demo_drink -o ${consumer}/walk.npz)
run(${CMAKE_COMMAND} -E chdir ${consumer} ./page)
run(${prefix}/bin/holdfast --version)

build(${CONSUMER_DIR}/../../examples/cpp ${examples})
run_example(live_fitting "" "^time_s,x,y,z,qw,qx,qy,qz,energy,ms,stop\n0[.]0333,-?0[.]"
            "\n4[.]8000,-?0[.][^\n]*,converged\n$")
run_example(batch_fit "fitted;demo_drink;mug,bottle" "^clip,frames,hands,"
            "\ndemo_drink_mug,145,right," "\ndemo_drink_bottle,145,right," "\n.worst.,[^\n]*\n$")
run_example(own_term "mug;demo_drink;upright" "tilt without the term: [1-9][0-9]"
            "tilt with the term:    [0-9][.]")
run_example(first_program "demo_drink;mug;first" "mug: 145 frames at 30 Hz" "\n  energy_distance_m2 +[0-9]"
            "\ncontact_frames_ratio +[01][.][0-9]+ +[01][.][0-9]+\n$")
run(${prefix}/bin/holdfast score ${examples}/upright)
run(${prefix}/bin/holdfast score ${examples}/first)
run(${prefix}/bin/holdfast score ${examples}/fitted/demo_drink_bottle.npz --object bottle)
