// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// What a file is. Files of this field first, then what lies beside them.
enum class FileKind {
  // Not a file that can be read.
  kMissing,
  kFolder,
  kResultFolder,  ///< clip.npz and metrics.json
  kSpecial,       ///< device, pipe, socket: never opened
  kUnreadable,
  kEmpty,
  kDamagedArchive,  ///< zip or gzip that does not open

  // .npz
  kClip,         ///< root_orient, pose_body, ... or poses (T, 165): SMPL-X
  kSmplhMotion,  ///< poses (T, 156): AMASS for SMPL-H
  kSmplMotion,   ///< poses (T, 72): SMPL
  kParameters,   ///< global_orient, body_pose, ...: SMPL-X parameters in the smplx package's names
  kGrab,         ///< GRAB sequence (Python objects)
  kBodyModel,    ///< v_template, weights, kintree_table: SMPL-X, SMPL-H, MANO, ...
  kNpz,          ///< none of these

  // Other containers.
  kNpy,
  kPickle,
  kTorch,  ///< zip or older form
  kSafetensors,
  kZip,

  // Motion.
  kBvh,
  kAmc,
  kAsf,
  kMarkers,  ///< C3D, TRC, Vicon's CSV, Qualisys' TSV
  kFbx,

  // Surfaces and scenes.
  kObj,
  kPly,
  kPlyPoints,  ///< .ply without faces
  kStl,
  kOff,
  kGlb,
  kGltf,
  kUsd,

  // JSON.
  kMetrics,      ///< metrics.json of a result, and other JSON that Holdfast writes
  kSkeletonMap,  ///< for import --map
  kJson,

  // What lies beside, or came in place of a file.
  kHtml,
  kGitLfsPointer,
  kHdf5,
  kMatlab,
  kPicture,
  kVideo,
  kText,
  kUnknown,
};

/// One line for people: "SMPL-X motion (.npz)".
std::string_view Describe(FileKind kind);

/// Whether it is one of the meshes that ReadMeshFile reads.
bool IsMesh(FileKind kind);

struct Identity {
  FileKind kind = FileKind::kUnknown;
  bool gzipped = false;              ///< the content was looked at through gzip
  std::size_t bytes = 0;             ///< size of the file
  std::vector<std::string> members;  ///< of an archive
  std::string detail;                ///< what tells the kind: a schema, keys
  std::string fault;                 ///< why it could not be opened; empty when it could
};

/// Tells what a file is by its content; its name is not looked at. Reads the first 64 KB, the
/// directory of archives, and JSON as a whole. Nothing in the file is executed. Does not throw for
/// any file.
Identity Identify(const std::filesystem::path& path);

}  // namespace holdfast
