# Builds the documentation site of SOURCE_DIR with the program and the Python module in BUILD_DIR,
# without a warning.
execute_process(COMMAND /usr/bin/python3 -c "import sphinx, furo, myst_parser, breathe, sphinx_copybutton"
                RESULT_VARIABLE missing OUTPUT_QUIET ERROR_VARIABLE what)
find_program(doxygen doxygen)
find_file(katex katex.js PATHS /usr/share/nodejs/katex/dist)
if(missing OR NOT doxygen OR NOT katex)
  message("SKIPPED: the site needs packages that './setup docs' installs (Sphinx, furo, MyST, breathe, doxygen, KaTeX): ${what}")
  return()
endif()
set(ENV{HOLDFAST_BUILD} ${BUILD_DIR})
set(ENV{PYTHONDONTWRITEBYTECODE} 1)
execute_process(COMMAND /usr/bin/python3 -m sphinx -W --keep-going -E -q -c docs/site . ${BUILD_DIR}/site
                WORKING_DIRECTORY ${SOURCE_DIR} COMMAND_ERROR_IS_FATAL ANY)
