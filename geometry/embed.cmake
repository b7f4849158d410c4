# Makes an assembler file that includes each file as it is, and a table of them: by the path below
# `root`, or, of files that lie elsewhere (absolute paths), by the last part of it.
# Assembling megabytes takes milliseconds; compiling them as C arrays takes minutes.
function(holdfast_embed target root)
  set(assembly ".section .rodata\n")
  set(externs "")
  set(table "")
  set(index 0)
  set(paths "")
  foreach(file IN LISTS ARGN)
    set(path "${root}/${file}")
    if(IS_ABSOLUTE "${file}")
      set(path "${file}")
      get_filename_component(file "${file}" NAME)
    endif()
    string(APPEND assembly
      ".global holdfast_embedded_${index}\n.global holdfast_embedded_end_${index}\n"
      ".balign 16\nholdfast_embedded_${index}:\n.incbin \"${path}\"\n"
      "holdfast_embedded_end_${index}:\n.byte 0\n")
    string(APPEND externs
      "extern const std::byte holdfast_embedded_${index}[], holdfast_embedded_end_${index}[];\n")
    string(APPEND table
      "    {\"${file}\", {holdfast_embedded_${index}, holdfast_embedded_end_${index}}},\n")
    list(APPEND paths "${path}")
    math(EXPR index "${index} + 1")
  endforeach()
  string(APPEND assembly ".section .note.GNU-stack,\"\",@progbits\n")
  set(assembly_file "${CMAKE_CURRENT_BINARY_DIR}/embedded_files.s")
  set(table_file "${CMAKE_CURRENT_BINARY_DIR}/embedded_table.cpp")
  file(CONFIGURE OUTPUT "${assembly_file}" CONTENT "${assembly}" @ONLY)
  file(CONFIGURE OUTPUT "${table_file}" CONTENT
"#include \"geometry/embedded.h\"\n
extern \"C\" {\n${externs}}\n
namespace holdfast {\n
std::span<const EmbeddedFile> EmbeddedFiles() {
  static const EmbeddedFile files[] = {\n${table}  };
  return files;
}\n
}  // namespace holdfast\n" @ONLY)
  set_source_files_properties("${assembly_file}" PROPERTIES OBJECT_DEPENDS "${paths}")
  target_sources(${target} PRIVATE "${assembly_file}" "${table_file}")
endfunction()
