# Bundles the report's player and the contact editor (three.js and the modules here) into a page and
# a section of one, whose paths are written to `result`. npm installs into the build folder, from
# package-lock.json here; nothing of it is needed at run time.
function(holdfast_bundle_player result)
  set(source "${CMAKE_CURRENT_FUNCTION_LIST_DIR}")
  set(binary "${CMAKE_CURRENT_BINARY_DIR}/player")
  set(installed "${binary}/node_modules/.package-lock.json")
  add_custom_command(OUTPUT "${installed}"
    COMMAND ${CMAKE_COMMAND} -E make_directory "${binary}"
    COMMAND ${CMAKE_COMMAND} -E copy "${source}/package.json" "${source}/package-lock.json"
            "${binary}"
    COMMAND ${HOLDFAST_NPM} ci --prefix "${binary}" --ignore-scripts --no-audit --no-fund
            --loglevel=error
    COMMAND ${CMAKE_COMMAND} -E touch "${installed}"
    DEPENDS "${source}/package.json" "${source}/package-lock.json"
    COMMENT "Installing three.js and esbuild for the report's player" VERBATIM)
  file(GLOB modules CONFIGURE_DEPENDS "${source}/*.js" "${source}/*.mjs" "${source}/*.css"
       "${source}/*.html")
  set(pages "${binary}/player.html" "${binary}/contacts.html")
  add_custom_command(OUTPUT ${pages}
    COMMAND ${HOLDFAST_NODE} "${source}/build.mjs" "${binary}/node_modules" ${pages}
    DEPENDS "${installed}" ${modules}
    COMMENT "Bundling the report's player" VERBATIM)
  set(${result} "${pages}" PARENT_SCOPE)
endfunction()
