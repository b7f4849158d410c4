// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// What a file is: first the formats of this field, then other files found next to them.
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
  kNpz,          ///< any other .npz

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

  // Files found next to these, or received in their place.
  kHtml,
  kGitLfsPointer,
  kHdf5,
  kMatlab,
  kPicture,
  kVideo,
  kText,
  kUnknown,
};

/// One-line description: "SMPL-X motion (.npz)".
std::string_view Describe(FileKind kind);

/// kBvh, kAmc or kAsf for a text that begins like one of them, else kUnknown.
FileKind MotionTextKind(std::string_view text);

/// Whether the kind is a mesh that ReadMeshFile reads.
bool IsMesh(FileKind kind);

struct Identity {
  FileKind kind = FileKind::kUnknown;
  bool gzipped = false;              ///< the content was inspected through gzip
  std::size_t bytes = 0;             ///< size of the file
  std::vector<std::string> members;  ///< member names of an archive
  std::string detail;                ///< what identifies the kind: a schema, keys
  std::string fault;                 ///< why it could not be opened; empty if it could
};

/// Detects what a file is from its content; its name is ignored. Reads the first 64 KB, the
/// directory of an archive, and all of a JSON file. Executes nothing in the file. Does not throw
/// for any file.
Identity Identify(const std::filesystem::path& path);

}  // namespace holdfast
