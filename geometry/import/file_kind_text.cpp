// SPDX-License-Identifier: MIT
#include "geometry/import/file_kind.h"

namespace holdfast {

std::string_view Describe(FileKind kind) {
  switch (kind) {
    case FileKind::kMissing:
      return "no such file";
    case FileKind::kFolder:
      return "folder";
    case FileKind::kResultFolder:
      return "result folder of Holdfast";
    case FileKind::kSpecial:
      return "not a regular file";
    case FileKind::kUnreadable:
      return "file that cannot be read";
    case FileKind::kEmpty:
      return "empty file";
    case FileKind::kDamagedArchive:
      return "damaged archive";
    case FileKind::kClip:
      return "SMPL-X motion (.npz)";
    case FileKind::kSmplhMotion:
      return "SMPL-H motion, as in AMASS (.npz)";
    case FileKind::kSmplMotion:
      return "SMPL motion (.npz)";
    case FileKind::kParameters:
      return "SMPL-X parameters in smplx's names (.npz)";
    case FileKind::kGrab:
      return "GRAB sequence (.npz)";
    case FileKind::kBodyModel:
      return "body model (.npz)";
    case FileKind::kNpz:
      return "numpy archive (.npz)";
    case FileKind::kNpy:
      return "numpy array (.npy)";
    case FileKind::kPickle:
      return "Python pickle";
    case FileKind::kTorch:
      return "torch archive";
    case FileKind::kSafetensors:
      return "network weights (safetensors)";
    case FileKind::kZip:
      return "zip archive";
    case FileKind::kBvh:
      return "motion: BVH";
    case FileKind::kAmc:
      return "motion: Acclaim (.amc)";
    case FileKind::kAsf:
      return "skeleton: Acclaim (.asf)";
    case FileKind::kMarkers:
      return "marker recording";
    case FileKind::kFbx:
      return "FBX scene";
    case FileKind::kObj:
      return "mesh: Wavefront (.obj)";
    case FileKind::kPly:
      return "mesh: .ply";
    case FileKind::kPlyPoints:
      return "point cloud: .ply";
    case FileKind::kStl:
      return "mesh: .stl";
    case FileKind::kOff:
      return "mesh: .off";
    case FileKind::kGlb:
      return "scene: glTF binary (.glb)";
    case FileKind::kGltf:
      return "scene: glTF (.gltf)";
    case FileKind::kUsd:
      return "scene: USD";
    case FileKind::kMetrics:
      return "Holdfast's metrics (JSON)";
    case FileKind::kSkeletonMap:
      return "skeleton map for import (JSON)";
    case FileKind::kJson:
      return "JSON";
    case FileKind::kHtml:
      return "web page (HTML)";
    case FileKind::kGitLfsPointer:
      return "Git LFS pointer";
    case FileKind::kHdf5:
      return "HDF5";
    case FileKind::kMatlab:
      return "MATLAB data";
    case FileKind::kPicture:
      return "picture";
    case FileKind::kVideo:
      return "video";
    case FileKind::kText:
      return "text";
    case FileKind::kUnknown:
      break;
  }
  return "unknown";
}

}  // namespace holdfast
