# Makes reports with HOLDFAST and looks at them in a headless Chromium, in WORK_DIR.
include(${CMAKE_CURRENT_LIST_DIR}/npm_install.cmake)
find_program(chromium NAMES chromium chromium-browser google-chrome)
if(NOT chromium)
  message("SKIPPED: chromium is not installed")
  return()
endif()
holdfast_npm_install(node show_report.mjs)
if(NOT node)
  return()
endif()
foreach(arguments "fit demo_drink mug -o with_mug --no-report" "fit demo_drink bottle -o with_bottle --no-report"
                  "reach --goal 1.5,1.0,0.8 --goal -0.5,1.5,1.1 --object mug --grasp -o taken --no-report"
                  "report with_mug -o one.html" "report taken -o take.html"
                  "report with_mug with_bottle -o two.html"
                  "report with_mug with_bottle demo_inspect -o three.html" "report demo_inspect -o motion.html"
                  "report demo_drink -o hostile.html --title </script><script>window.hacked=1</script>&amp;<b>")
  separate_arguments(words UNIX_COMMAND "${arguments} --force --quiet")
  execute_process(COMMAND ${HOLDFAST} ${words} WORKING_DIRECTORY ${WORK_DIR} OUTPUT_QUIET
                  COMMAND_ERROR_IS_FATAL ANY)
endforeach()
# Exit code 3: the robot does not keep enough contacts, which matters little here.
execute_process(COMMAND ${HOLDFAST} transfer with_mug --robot ${CMAKE_CURRENT_LIST_DIR}/../fixtures/cases/doctor_robot/hand.urdf
                        -o robot --force --quiet
                WORKING_DIRECTORY ${WORK_DIR} RESULT_VARIABLE code OUTPUT_QUIET)
if(NOT code MATCHES "^[03]$")
  message(FATAL_ERROR "transfer: ${code}")
endif()
get_filename_component(programs ${HOLDFAST} DIRECTORY)
set(ENV{PATH} "${programs}:$ENV{PATH}")  # the page of a transfer shows a command, which is run
execute_process(COMMAND ${node} show_report.mjs ${chromium}
                WORKING_DIRECTORY ${WORK_DIR} COMMAND_ERROR_IS_FATAL ANY)
