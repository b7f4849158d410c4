# Debian packages by CPack: holdfast (the program), libholdfast0.1 and libholdfast-dev (shared library,
# headers), python3-holdfast. Program and Python module contain the library, so that each installs
# alone. `./setup package` configures with HOLDFAST_PACKAGES, builds and packs.
find_program(HOLDFAST_HELP2MAN help2man REQUIRED)

set(man_pages ${CMAKE_CURRENT_BINARY_DIR}/man)
set(completion ${CMAKE_CURRENT_BINARY_DIR}/holdfast.completion)
add_custom_command(OUTPUT ${completion}
  COMMAND ${CMAKE_CURRENT_LIST_DIR}/man_pages.sh $<TARGET_FILE:holdfast> ${man_pages} ${PROJECT_VERSION}
  COMMAND $<TARGET_FILE:holdfast> --bash-completion > ${completion}
  DEPENDS holdfast ${CMAKE_CURRENT_LIST_DIR}/man_pages.sh VERBATIM)
add_custom_target(holdfast_man ALL DEPENDS ${completion})
install(DIRECTORY ${man_pages}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${completion} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
        RENAME holdfast COMPONENT program)

# What Debian asks of every package's folder of documents.
set(release 1)
set(maintainer "The Holdfast authors <holdfast@localhost>")
if(DEFINED ENV{DEBEMAIL} AND DEFINED ENV{DEBFULLNAME})
  set(maintainer "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
endif()
string(TIMESTAMP date "%a, %d %b %Y 12:00:00 +0000" UTC)
configure_file(${CMAKE_CURRENT_LIST_DIR}/changelog.in changelog.Debian @ONLY)
configure_file(${CMAKE_CURRENT_LIST_DIR}/copyright.in copyright @ONLY)
foreach(pair "changelog.Debian:${CMAKE_CURRENT_BINARY_DIR}/changelog.Debian" "changelog:${PROJECT_SOURCE_DIR}/CHANGELOG.md")
  string(REGEX MATCH "^[^:]+" name "${pair}")
  string(REGEX REPLACE "^[^:]+:" "" source "${pair}")
  execute_process(COMMAND gzip -9nc ${source} OUTPUT_FILE ${CMAKE_CURRENT_BINARY_DIR}/${name}.gz
                  COMMAND_ERROR_IS_FATAL ANY)
endforeach()
set(shared_package libholdfast${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
foreach(pair "program:holdfast" "runtime:${shared_package}" "development:libholdfast-dev" "python:python3-holdfast")
  string(REGEX MATCH "^[^:]+" component "${pair}")
  string(REGEX REPLACE "^[^:]+:" "" package "${pair}")
  # Who builds a package is its maintainer, by the variables that Debian's tools read; without them
  # there is no address to write to.
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/overrides/${package}
       "${package}: bogus-mail-host *\n${package}: bogus-mail-host-in-debian-changelog *\n${package}: initial-upload-closes-no-bugs *\n")
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/overrides/${package}
          DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides COMPONENT ${component})
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/changelog.Debian.gz ${CMAKE_CURRENT_BINARY_DIR}/changelog.gz
                ${CMAKE_CURRENT_BINARY_DIR}/copyright
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package's own, below
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program runtime development python)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_PACKAGE_CONTACT "${maintainer}")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE ${release})
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "ffmpeg, bash-completion, python3-holdfast")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_BINARY_DIR}/triggers)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${shared_package} (= ${PROJECT_VERSION}-${release}), libeigen3-dev, libceres-dev, nlohmann-json3-dev, libfmt-dev")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "ffmpeg, python3-torch")
if(HOLDFAST_BUILD_PYTHON)
  # The module is of one version of Python.
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  math(EXPR next "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next}), python3-numpy")
endif()
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION
"fits objects to moving human hands and generates human motion
Given a human motion (SMPL-X parameters) and an object mesh, solves object
pose and finger angles for every frame, without a GPU. Also generates motion
that reaches, takes and uses objects, and measures and shows results.")
set(CPACK_DEBIAN_RUNTIME_DESCRIPTION
"fits objects to moving human hands - shared library
What programs need that were built with libholdfast-dev.")
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION
"fits objects to moving human hands - C++ library
Headers of Holdfast for C++20: body models, meshes,
distances, energy terms on Ceres, grasps, the fit as a whole and frame by
frame, motion generation. For use by find_package(holdfast) in CMake.")
set(CPACK_DEBIAN_PYTHON_DESCRIPTION
"fits objects to moving human hands - Python module
Holdfast on numpy arrays: fit, grasp, reach, score and render, the body model
and the energy terms with gradients, also as PyTorch functions.")
include(CPack)
