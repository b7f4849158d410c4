// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_reader.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/gltf/asset/gltf_asset.h"
#include "geometry/io/gltf/gltf_sampler.h"
#include "geometry/io/gltf/gltf_skeleton.h"
#include "geometry/io/mesh/gltf_mesh.h"

namespace holdfast {
namespace {

constexpr std::size_t kFewestBodyJoints = 13;  // pelvis, and three per limb
constexpr double kMaxBytesPerFileByte = 10;
constexpr double kFreeBytes = 48 << 20;
constexpr double kFarthest = 1e5;  // largest allowed distance from the origin, meters

std::string Quoted(const std::vector<std::string>& names) {
  return fmt::format("'{}'", fmt::join(names, "', '"));
}

std::set<int> JointsOf(const std::vector<GltfCharacter>& characters) {
  std::set<int> joints;
  for (const GltfCharacter& character : characters) {
    joints.insert(character.joints.begin(), character.joints.end());
  }
  return joints;
}

class GltfMotionReader {
 public:
  GltfMotionReader(const GltfAsset& asset, const GltfMotionOptions& options)
      : asset_(asset), options_(options) {}

  SourceMotion Read() {
    motion_.format = "glTF";
    motion_.betas = asset_.clip_betas;
    motion_.gender = asset_.clip_gender;
    motion_.body_model = asset_.clip_body_model;
    if (asset_.animations.empty()) {
      throw Error(asset_.Where(), "holds no animation",
                  "Export the character with its animation (a glTF may hold only its mesh)");
    }
    std::vector<GltfCharacter> characters = FindCharacters(asset_);
    KeepNamed(characters);
    const GltfAnimation& animation = ChooseAnimation(characters);
    const GltfSampler sampler(asset_, animation);
    const GltfCharacter character = ChooseCharacter(characters, animation, sampler);
    skeleton_ = BuildSkeleton(asset_, WithHumanoid(character));
    for (std::string& note : skeleton_.notes) motion_.notes.push_back(std::move(note));
    prop_ = FindProp(sampler);
    Sample(sampler);
    return std::move(motion_);
  }

  GltfRig ReadRig() {
    motion_.format = "glTF";
    which_ = "Export one of them alone";
    std::vector<GltfCharacter> characters = FindCharacters(asset_);
    if (characters.empty() && !asset_.humanoid.empty()) {
      std::vector<int> bones;
      for (const auto& [bone, node] : asset_.humanoid) bones.push_back(node);
      characters.push_back(CharacterOfNodes(asset_, std::move(bones)));
    }
    if (characters.empty()) {
      throw Error(asset_.Where(), "holds no skinned character",
                  "Give a character with its skeleton and skin");
    }
    const std::set<int> joints = JointsOf(characters);
    const bool moves = std::ranges::any_of(asset_.animations, [&](const GltfAnimation& animation) {
      return Duration(animation, joints) >= 0;
    });
    const GltfAnimation still;
    const GltfAnimation& animation = moves ? ChooseAnimation(characters) : still;
    const GltfSampler sampler(asset_, animation);
    skeleton_ =
        BuildSkeleton(asset_, WithHumanoid(moves ? ChooseCharacter(characters, animation, sampler)
                                                 : OnlyBody(characters)));
    Sample(sampler);
    if (Mirrors()) {
      throw Error(asset_.Where(), "its scene mirrors the character (a negative scale above it)",
                  "Apply the scale in Blender (Object > Apply > Scale), and export it again");
    }
    GltfRig rig{std::move(motion_), skeleton_.nodes, {}};
    for (const Eigen::Affine3d& rest : skeleton_.rest) {
      rig.rest_rotations.push_back(RotationWithin(rest.linear()));
    }
    return rig;
  }

 private:
  // Chooses among characters that do not move.
  const GltfCharacter& OnlyBody(const std::vector<GltfCharacter>& characters) const {
    const GltfCharacter* body = &characters[0];
    std::vector<std::string> bodies;
    for (const GltfCharacter& character : characters) {
      if (character.joints.size() < kFewestBodyJoints) continue;
      bodies.push_back(character.name);
      body = &character;
    }
    if (bodies.size() > 1) {
      throw Error(asset_.Where(),
                  fmt::format("holds {} characters: {}", bodies.size(), Quoted(bodies)), which_);
    }
    return *body;
  }

  void KeepNamed(std::vector<GltfCharacter>& characters) const {
    if (options_.character.empty()) return;
    std::vector<std::string> names;
    std::vector<GltfCharacter> kept;
    for (GltfCharacter& character : characters) {
      names.push_back(character.name);
      const bool named = character.name == options_.character ||
                         std::ranges::any_of(character.joints, [&](int joint) {
                           return asset_.NodeAt(joint).name == options_.character;
                         });
      if (named) kept.push_back(std::move(character));
    }
    if (kept.empty()) {
      throw Error(asset_.Where(), fmt::format("has no character '{}'", options_.character),
                  fmt::format("Its characters are {}", Quoted(names)));
    }
    characters = std::move(kept);
  }

  // Seconds from the first key to the last; -1 if the animation moves none of these nodes.
  double Duration(const GltfAnimation& animation, const std::set<int>& nodes) const {
    double begin = HUGE_VAL, end = -HUGE_VAL;
    bool moves = false;
    std::set<int> inputs;
    for (const GltfChannel& channel : animation.channels) {
      if (channel.path == GltfPath::kScale) continue;
      if (!nodes.empty() && !nodes.contains(channel.node)) continue;
      moves = true;
      if (!inputs.insert(channel.input).second) continue;
      const GltfNumbers times(asset_, channel.input, 1);
      if (times.Count() == 0) continue;
      begin = std::min(begin, times(0, 0));
      end = std::max(end, times(times.Count() - 1, 0));
    }
    // The sampler reports times that are not numbers.
    return !moves ? -1 : end >= begin ? end - begin : 0;
  }

  const GltfAnimation& ChooseAnimation(const std::vector<GltfCharacter>& characters) {
    const std::set<int> joints = JointsOf(characters);
    const GltfAnimation* best = nullptr;
    double longest = -1;
    std::vector<std::string> told, names;
    for (const GltfAnimation& animation : asset_.animations) {
      const double duration = Duration(animation, joints);
      const bool wanted = options_.animation.empty() || animation.name == options_.animation;
      if (wanted && duration > longest) {
        best = &animation;
        longest = duration;
      }
      if (names.size() == 20) continue;  // a message needs only the first of thousands
      names.push_back(animation.name);
      told.push_back(duration < 0 ? fmt::format("'{}' (moves no joint)", animation.name)
                                  : fmt::format("'{}' ({:.2f} s)", animation.name, duration));
    }
    if (best == nullptr && !options_.animation.empty()) {
      throw Error(asset_.Where(),
                  fmt::format("has no animation '{}' that moves the character", options_.animation),
                  fmt::format("Its animations are {}", fmt::join(told, ", ")));
    }
    if (best == nullptr) {
      throw Error(asset_.Where(),
                  fmt::format("its animations ({}) move no joint of a character", Quoted(names)),
                  "Export the character's own animation with it");
    }
    if (asset_.animations.size() > 1 && options_.animation.empty()) {
      motion_.notes.push_back(fmt::format("{} animations: {}; '{}' is used, the longest",
                                          asset_.animations.size(), fmt::join(told, ", "),
                                          best->name));
    }
    return *best;
  }

  GltfCharacter ChooseCharacter(std::vector<GltfCharacter>& characters,
                                const GltfAnimation& animation, const GltfSampler& sampler) {
    if (characters.empty()) {
      std::vector<int> nodes;
      for (const GltfChannel& channel : animation.channels) {
        if (sampler.MovesRigidly(channel.node)) nodes.push_back(channel.node);
      }
      std::sort(nodes.begin(), nodes.end());
      nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
      if (nodes.size() < kFewestBodyJoints) {
        std::vector<std::string> names;
        for (const int node : nodes) names.push_back(asset_.NodeText(node));
        throw Error(
            asset_.Where(),
            fmt::format("holds no skinned character; its animation '{}' moves only {} nodes: {}",
                        animation.name, nodes.size(), fmt::join(names, ", ")),
            "Export the character with its skeleton; a moving object alone is not a clip");
      }
      motion_.notes.push_back(
          fmt::format("no skin: the {} animated nodes are used as the skeleton, with their static "
                      "pose in the file as the rest pose",
                      nodes.size()));
      return CharacterOfNodes(asset_, std::move(nodes));
    }
    std::vector<GltfCharacter> moved;
    std::vector<std::string> names;
    for (GltfCharacter& character : characters) {
      const bool moves = std::ranges::any_of(
          character.joints, [&](int joint) { return sampler.MovesRigidly(joint); });
      if (!moves) continue;
      names.push_back(character.name);
      moved.push_back(std::move(character));
    }
    if (moved.size() > 1) {
      // A character next to things with bones of their own (a chain, a plant) need not be named.
      std::vector<std::size_t> bodies;
      for (std::size_t i = 0; i < moved.size(); ++i) {
        if (moved[i].joints.size() >= kFewestBodyJoints) bodies.push_back(i);
      }
      if (bodies.size() != 1) {
        throw Error(asset_.Where(),
                    fmt::format("animation '{}' moves {} characters: {}", animation.name,
                                moved.size(), Quoted(names)),
                    which_);
      }
      std::swap(moved[0], moved[bodies[0]]);
    }
    if (characters.size() > 1) {
      motion_.notes.push_back(fmt::format("{} characters; '{}' is used, the one that moves",
                                          characters.size(), moved[0].name));
    }
    return std::move(moved[0]);
  }

  // Bones that neither hold vertices nor move are joints, too, if VRM's extension names them.
  GltfCharacter WithHumanoid(GltfCharacter character) const {
    std::vector<int>& joints = character.joints;
    const auto known = std::ranges::count_if(asset_.humanoid, [&](const auto& bone) {
      return std::ranges::binary_search(joints, bone.second);
    });
    if (2 * known < static_cast<std::ptrdiff_t>(asset_.humanoid.size())) return character;
    for (const auto& [bone, node] : asset_.humanoid) joints.push_back(node);
    std::ranges::sort(joints);
    joints.erase(std::unique(joints.begin(), joints.end()), joints.end());
    return character;
  }

  // Finds the mesh that moves independently of the skeleton.
  std::optional<int> FindProp(const GltfSampler& sampler) {
    std::vector<bool> body(asset_.nodes.size(), false);   // the root of the skeleton or below it
    std::vector<bool> moves(asset_.nodes.size(), false);  // itself or through an ancestor
    std::vector<bool> above(asset_.nodes.size(), false);  // ancestor of the skeleton
    body[skeleton_.nodes[0]] = true;
    for (int node = asset_.NodeAt(skeleton_.nodes[0]).parent; node >= 0;
         node = asset_.NodeAt(node).parent) {
      above[node] = true;
    }
    std::vector<int> found;
    std::vector<std::string> names;
    for (const int node : asset_.order) {
      const auto k = static_cast<std::size_t>(node);
      const GltfNode& own = asset_.NodeAt(node);
      if (own.parent >= 0) {
        const auto parent = static_cast<std::size_t>(own.parent);
        body[k] = body[k] || body[parent];
        moves[k] = moves[parent];
      }
      if (above[k]) continue;
      moves[k] = moves[k] || sampler.MovesRigidly(node);
      const bool named = !options_.prop.empty() && own.name == options_.prop;
      const bool carried = !body[k] && moves[k] && own.mesh >= 0 && own.skin < 0;
      if (!named && !(options_.prop.empty() && carried)) continue;
      found.push_back(node);
      names.push_back(PropName(node));
    }
    if (!options_.prop.empty() && found.empty()) {
      throw Error(asset_.Where(), fmt::format("has no node '{}'", options_.prop),
                  "Give the name of the object's node");
    }
    if (found.empty()) return std::nullopt;
    if (found.size() > 1) {
      names.resize(std::min<std::size_t>(names.size(), 20));
      motion_.notes.push_back(
          fmt::format("{} nodes move besides the body ({}); '{}' is used as the object",
                      found.size(), Quoted(names), names[0]));
    }
    return found[0];
  }

  std::string PropName(int node) const {
    const GltfNode& own = asset_.NodeAt(node);
    if (!own.name.empty() || own.mesh < 0) return own.name;
    return asset_.meshes[own.mesh].name;
  }

  int NumFrames(const GltfSampler& sampler) {
    bool regular = true;
    motion_.frame_rate = options_.frame_rate > 0
                             ? options_.frame_rate
                             : sampler.FrameRate(asset_.clip_frame_rate, regular);
    if (!regular) {
      motion_.notes.push_back(
          fmt::format("the key times are irregular: sampled at {:g} Hz", motion_.frame_rate));
    }
    const double frames =
        std::floor((sampler.End() - sampler.Begin()) * motion_.frame_rate + 0.01) + 1;
    const double joints = static_cast<double>(skeleton_.nodes.size());
    const double bytes =
        frames * (joints * (sizeof(Eigen::Quaterniond) + sizeof(Eigen::Vector3d)) + 160);
    const double limit = kMaxBytesPerFileByte * static_cast<double>(asset_.NumBytes()) + kFreeBytes;
    if (!(bytes < limit) || frames * joints > kMaxJointFrames) {
      throw Error(asset_.Where(),
                  fmt::format("{:.1f} s at {:g} Hz make {:.0f} frames, far more than a file of {} "
                              "bytes should hold",
                              sampler.End() - sampler.Begin(), motion_.frame_rate, frames,
                              asset_.NumBytes()),
                  "Give a lower --source-fps, or cut the animation into parts");
    }
    return static_cast<int>(frames);
  }

  // Collects all nodes that place the skeleton and the prop, parents first, and numbers them.
  void GatherChain() {
    std::vector<bool> needed(asset_.nodes.size(), false);
    const auto need = [&](int node) {
      for (; node >= 0 && !needed[node]; node = asset_.NodeAt(node).parent) {
        needed[node] = true;
      }
    };
    for (const int node : skeleton_.nodes) need(node);
    if (prop_) need(*prop_);
    place_.assign(asset_.nodes.size(), -1);
    for (const int node : asset_.order) {
      if (!needed[node]) continue;
      place_[node] = static_cast<int>(chain_.size());
      chain_.push_back(node);
    }
  }

  const Eigen::Affine3d& World(int node) const { return world_[place_[node]]; }

  void Pose(const GltfSampler& sampler, double time) {
    const double snap = 1e-4 / motion_.frame_rate + 2.4e-7 * std::abs(time);
    world_.resize(chain_.size());
    for (std::size_t k = 0; k < chain_.size(); ++k) {
      const int parent = asset_.NodeAt(chain_[k]).parent;
      const Eigen::Affine3d local = sampler.Local(chain_[k], time, snap);
      world_[k] = parent < 0 ? local : World(parent) * local;
    }
  }

  void Sample(const GltfSampler& sampler) {
    const int frames = NumFrames(sampler);
    GatherChain();
    if (static_cast<double>(chain_.size()) * frames > kMaxJointFrames) {
      throw Error(asset_.Where(),
                  fmt::format("the character is below {} nested nodes", chain_.size()),
                  "Export the character alone");
    }
    const std::size_t joints = skeleton_.nodes.size();
    for (const int node : skeleton_.nodes) {
      const std::string& name = asset_.NodeAt(node).name;
      motion_.joint_names.push_back(name.empty() ? fmt::format("node {}", node) : name);
    }
    motion_.parents = skeleton_.parents;
    for (const auto& [bone, node] : asset_.humanoid) {
      const auto joint = std::ranges::find(skeleton_.nodes, node);
      if (joint == skeleton_.nodes.end()) continue;
      motion_.humanoid.emplace(bone, static_cast<int>(joint - skeleton_.nodes.begin()));
    }
    std::vector<Eigen::Matrix3d> joint_from_rest(joints);
    for (std::size_t k = 0; k < joints; ++k) {
      joint_from_rest[k] = RotationWithin(skeleton_.rest[k].linear()).transpose();
    }
    motion_.positions.reserve(static_cast<std::size_t>(frames));
    motion_.rotations.reserve(static_cast<std::size_t>(frames) * joints);
    if (prop_) {
      SourceMotion::Prop& prop = motion_.prop.emplace();
      prop.name = PropName(*prop_);
      prop.positions.resize(3, frames);
      prop.rotations.reserve(static_cast<std::size_t>(frames));
    }
    Eigen::Matrix3d unmirror = Eigen::Matrix3d::Identity();
    for (int t = 0; t < frames; ++t) {
      Pose(sampler, sampler.Begin() + t / motion_.frame_rate);
      if (t == 0) unmirror = Unmirror();
      Eigen::Matrix3Xd positions(3, static_cast<Eigen::Index>(joints));
      for (std::size_t k = 0; k < joints; ++k) {
        const Eigen::Affine3d& world = World(skeleton_.nodes[k]);
        positions.col(static_cast<Eigen::Index>(k)) =
            options_.meters_per_unit * (unmirror * world.translation());
        motion_.rotations.emplace_back(RotationWithin(unmirror * world.linear()) *
                                       joint_from_rest[k]);
        motion_.rotations.back().normalize();
      }
      if (!positions.allFinite() || positions.cwiseAbs().maxCoeff() > kFarthest) {
        throw Error(
            asset_.Where(),
            fmt::format("frame {} lies more than {:g} km from the origin", t, 1e-3 * kFarthest),
            "Correct the unit (--meters-per-unit), or export the animation again");
      }
      motion_.positions.push_back(std::move(positions));
      if (prop_) PlaceProp(t, unmirror);
    }
    ScaleRest();
  }

  bool Mirrors() const {
    return World(skeleton_.nodes[0]).linear().determinant() *
               skeleton_.rest[0].linear().determinant() <
           0;
  }

  // Undoes a mirroring of the character by the scene, so that the names of joints keep their sides.
  Eigen::Matrix3d Unmirror() {
    if (!Mirrors()) return Eigen::Matrix3d::Identity();
    motion_.notes.emplace_back(
        "the scene mirrors its character (a negative scale above the skeleton): imported without "
        "the mirroring");
    return Eigen::Vector3d(-1, 1, 1).asDiagonal();
  }

  void PlaceProp(int frame, const Eigen::Matrix3d& unmirror) {
    SourceMotion::Prop& prop = *motion_.prop;
    const Eigen::Affine3d& world = World(*prop_);
    const Eigen::Matrix3d linear = unmirror * world.linear();
    prop.positions.col(frame) = options_.meters_per_unit * (unmirror * world.translation());
    const Eigen::Matrix3d R = RotationWithin(linear);
    prop.rotations.emplace_back(R);
    prop.rotations.back().normalize();
    if (!prop.positions.col(frame).allFinite() || !linear.allFinite() ||
        prop.positions.col(frame).cwiseAbs().maxCoeff() > kFarthest) {
      throw Error(
          asset_.Where(),
          fmt::format("'{}' has no finite position near the origin in frame {}", prop.name, frame),
          "Export the animation again");
    }
    if (frame > 0 || asset_.NodeAt(*prop_).mesh < 0) return;
    // Scale and shear go into the mesh: the remaining transform is rigid.
    prop.mesh = ReadGltfMesh(asset_, asset_.NodeAt(*prop_).mesh);
    const Eigen::Matrix3d shape = options_.meters_per_unit * R.transpose() * linear;
    prop.mesh.vertices = (shape * prop.mesh.vertices).eval();
    if (shape.determinant() < 0 && prop.mesh.NumFaces() > 0) {
      prop.mesh.faces.row(1).swap(prop.mesh.faces.row(2));
    }
    prop.look = ReadGltfLook(asset_, asset_.NodeAt(*prop_).mesh);
    if (prop.look) Transform(shape, *prop.look);
  }

  // The bind pose may be in other units than the scene (centimeters below a node that scales).
  void ScaleRest() {
    const auto joints = static_cast<Eigen::Index>(skeleton_.nodes.size());
    std::vector<double> ratios;
    Eigen::Matrix3Xd offsets(3, joints);
    for (Eigen::Index k = 0; k < joints; ++k) {
      const auto at = static_cast<std::size_t>(k);
      offsets.col(k) = skeleton_.rest[at].translation();
      const int parent = skeleton_.parents[at];
      if (parent < 0) continue;
      offsets.col(k) -= skeleton_.rest[parent].translation();
      const double shown = (motion_.positions[0].col(k) - motion_.positions[0].col(parent)).norm();
      const double at_rest = offsets.col(k).norm();
      if (at_rest > 1e-9 && shown > 1e-9) ratios.push_back(shown / at_rest);
    }
    double ratio = 1;
    if (!ratios.empty()) {
      const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
      std::nth_element(ratios.begin(), middle, ratios.end());
      if (std::abs(*middle - 1) > 1e-3) ratio = *middle;
    }
    motion_.rest_offsets = ratio * offsets;
    motion_.end_sites = std::move(skeleton_.end_sites);
    for (SourceMotion::EndSite& site : motion_.end_sites) site.offset *= ratio;
    if (!motion_.rest_offsets.allFinite()) {
      throw Error(asset_.Where(), "its bind pose is not finite", "Export the character again");
    }
  }

  const GltfAsset& asset_;
  const GltfMotionOptions& options_;
  const char* which_ = "Name one with --character";  // if there are several characters
  SourceMotion motion_;
  GltfSkeleton skeleton_;
  std::optional<int> prop_;
  std::vector<int> chain_;  // nodes to place, parents first
  std::vector<int> place_;  // index of each node in chain_, -1 for others
  std::vector<Eigen::Affine3d> world_;
};

}  // namespace

GltfRig ReadGltfRig(const GltfAsset& asset) {
  GltfMotionOptions options;
  options.frame_rate = 30;
  return GltfMotionReader(asset, options).ReadRig();
}

SourceMotion ReadGltfMotion(const std::filesystem::path& path, const GltfMotionOptions& options) {
  return GltfMotionReader(GltfAsset::Read(path), options).Read();
}

SourceMotion ParseGltfMotion(std::string bytes, const std::string& where,
                             const std::filesystem::path& folder,
                             const GltfMotionOptions& options) {
  return GltfMotionReader(GltfAsset::Parse(std::move(bytes), where, folder), options).Read();
}

}  // namespace holdfast
