# Exports .glb files with HOLDFAST and has the Khronos validator (npm) judge them, in WORK_DIR.
include(${CMAKE_CURRENT_LIST_DIR}/npm_install.cmake)
holdfast_npm_install(node validate_gltf.mjs)
if(NOT node)
  return()
endif()
# A textured object.
file(WRITE ${WORK_DIR}/box.mtl "newmtl paint\nmap_Kd paint.png\n")
file(WRITE ${WORK_DIR}/box.obj "mtllib box.mtl\nv 0 0 0\nv .06 0 0\nv 0 .06 0\nv 0 0 .06\nvt 0 0\nvt 1 0\nvt 0 1\n"
     "usemtl paint\nf 1/1 3/2 2/3\nf 1/1 2/2 4/3\nf 1/1 4/2 3/3\nf 2/1 3/2 4/3\n")
foreach(arguments "render demo_drink -o paint.png --size 32x32" "grasp box.obj -o box.npz"
                  "export box.npz -o box.glb --object box.obj" "fit demo_drink mug -o held" "export held -o held.glb"
                  "export held -o plain.glb --no-correctives --no-object"
                  "export demo_inspect -o short.glb --start 7 --end 8")
  separate_arguments(words UNIX_COMMAND "${arguments} --force --quiet")
  execute_process(COMMAND ${HOLDFAST} ${words} WORKING_DIRECTORY ${WORK_DIR} OUTPUT_QUIET
                  COMMAND_ERROR_IS_FATAL ANY)
endforeach()
execute_process(COMMAND ${node} validate_gltf.mjs held.glb plain.glb short.glb box.glb
                WORKING_DIRECTORY ${WORK_DIR} COMMAND_ERROR_IS_FATAL ANY)
