// SPDX-License-Identifier: MIT
#include "geometry/io/mesh/collada.h"

#include <string>

#include "geometry/error.h"
#include "geometry/io/container/text_scanner.h"

#ifdef HOLDFAST_HAS_ASSIMP
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>
#endif

namespace holdfast {

namespace fs = std::filesystem;

bool IsCollada(const fs::path& path) {
  return EqualIgnoringCase(path.extension().string(), ".dae");
}

#ifndef HOLDFAST_HAS_ASSIMP

TriangleMesh ReadCollada(const fs::path& path) {
  throw Error(path.string(), "is COLLADA, but this build of Holdfast does not include assimp",
              "Install libassimp-dev and build again, or convert the file to .obj or .glb");
}

#else

TriangleMesh ReadCollada(const fs::path& path) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  // With positions alone, vertices that differ in normals or texture are joined.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                  aiComponent_COLORS | aiComponent_TEXCOORDS |
                                  aiComponent_MATERIALS);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene = importer.ReadFile(
      path.string(), aiProcess_RemoveComponent | aiProcess_Triangulate | aiProcess_SortByPType |
                         aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices);
  if (scene == nullptr) {
    throw Error(path.string(), std::string("is not valid COLLADA: ") + importer.GetErrorString(),
                "Check it in the program that wrote it, or convert it to .obj or .glb");
  }
  Eigen::Index vertices = 0, faces = 0;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    vertices += scene->mMeshes[m]->mNumVertices;
    faces += scene->mMeshes[m]->mNumFaces;
  }
  TriangleMesh mesh;
  mesh.vertices.resize(3, vertices);
  mesh.faces.resize(3, faces);
  vertices = faces = 0;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      for (int k = 0; k < 3; ++k) {
        mesh.faces(k, faces) = static_cast<int>(vertices + face.mIndices[k]);
      }
      ++faces;
    }
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D& p = part.mVertices[v];
      mesh.vertices.col(vertices++) = Eigen::Vector3d(p.x, p.y, p.z);
    }
  }
  mesh.faces.conservativeResize(Eigen::NoChange, faces);
  if (faces == 0) {
    throw Error(path.string(), "has no triangle in its scene",
                "Export it again, with the geometry in the visual scene");
  }
  return mesh;
}

#endif

}  // namespace holdfast
