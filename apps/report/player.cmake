# Bundles the report's player (three.js and the modules here) into one page and puts it into
# `target`. npm installs into the build folder, from apps/report/package-lock.json; nothing of it is
# needed at run time.
function(holdfast_add_player target)
  set(source "${CMAKE_CURRENT_SOURCE_DIR}/report")
  set(binary "${CMAKE_CURRENT_BINARY_DIR}/report")
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
  set(page "${binary}/player.html")
  add_custom_command(OUTPUT "${page}"
    COMMAND ${HOLDFAST_NODE} "${source}/build.mjs" "${binary}/node_modules" "${page}"
    DEPENDS "${installed}" ${modules}
    COMMENT "Bundling the report's player" VERBATIM)
  file(CONFIGURE OUTPUT "${binary}/player.s" CONTENT
".section .rodata
.global holdfast_player_page
.global holdfast_player_page_end
holdfast_player_page:
.incbin \"${page}\"
holdfast_player_page_end:
.byte 0
.section .note.GNU-stack,\"\",@progbits
" @ONLY)
  set_source_files_properties("${binary}/player.s" PROPERTIES OBJECT_DEPENDS "${page}")
  target_sources(${target} PRIVATE "${binary}/player.s")
  target_compile_definitions(${target} PRIVATE HOLDFAST_HAS_PLAYER)
endfunction()
