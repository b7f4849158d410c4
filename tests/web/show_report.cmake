# Makes reports with HOLDFAST and looks at them in a headless Chromium, in WORK_DIR.
find_program(node node)
find_program(npm npm)
find_program(chromium NAMES chromium chromium-browser google-chrome)
if(NOT node OR NOT npm OR NOT chromium)
  message("SKIPPED: node, npm and chromium are needed to look at reports")
  return()
endif()
file(MAKE_DIRECTORY ${WORK_DIR})
foreach(name package.json package-lock.json show_report.mjs)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/${name} ${WORK_DIR}/${name} COPYONLY)
endforeach()
file(SHA256 ${WORK_DIR}/package-lock.json lock)
if(NOT EXISTS ${WORK_DIR}/installed-${lock})
  execute_process(COMMAND ${npm} ci --ignore-scripts --no-audit --no-fund
                  WORKING_DIRECTORY ${WORK_DIR}
                  RESULT_VARIABLE failed OUTPUT_QUIET ERROR_QUIET TIMEOUT 120)
  if(failed)
    message("SKIPPED: npm could not install playwright-core (no network?)")
    return()
  endif()
  file(TOUCH ${WORK_DIR}/installed-${lock})
endif()
foreach(arguments "fit demo_drink mug -o with_mug --no-report" "fit demo_drink bottle -o with_bottle --no-report"
                  "report with_mug -o one.html"
                  "report with_mug with_bottle -o two.html"
                  "report with_mug with_bottle demo_inspect -o three.html" "report demo_inspect -o motion.html"
                  "report demo_drink -o hostile.html --title </script><script>window.hacked=1</script>&amp;<b>")
  separate_arguments(words UNIX_COMMAND "${arguments} --force --quiet")
  execute_process(COMMAND ${HOLDFAST} ${words} WORKING_DIRECTORY ${WORK_DIR} OUTPUT_QUIET
                  COMMAND_ERROR_IS_FATAL ANY)
endforeach()
execute_process(COMMAND ${node} show_report.mjs ${chromium}
                WORKING_DIRECTORY ${WORK_DIR} COMMAND_ERROR_IS_FATAL ANY)
