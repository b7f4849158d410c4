// SPDX-License-Identifier: MIT
#include "generator/imos/synthesis_network.h"

#include <algorithm>
#include <filesystem>
#include <string>

#include <fmt/format.h>

#include "generator/wandr/rollout.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/safetensors.h"
#include "geometry/parallel.h"

namespace holdfast {
namespace {

constexpr double kPublishedSeconds = 0.1;

// Returns a JSON note of the weights, or an empty object if there is none.
nlohmann::json JsonNote(const imos::NetworkWeights& weights, const std::string& name,
                        const std::string& where) {
  const auto note = weights.notes.find(name);
  if (note == weights.notes.end()) return nlohmann::json::object();
  nlohmann::json value = nlohmann::json::parse(note->second, nullptr, false);
  if (!value.is_object()) {
    throw Error(where, "its note '" + name + "' is not a JSON object",
                "Use weights of 'holdfast.train imos'");
  }
  return value;
}

}  // namespace

SynthesisNetwork LoadSynthesisNetwork(const std::string& path, const std::string& vectors) {
  SynthesisNetwork network;
  if (path.empty()) {
    const EmbeddedFile file = FindEmbedded("networks/imos.safetensors");
    network.source = "embedded";
    network.weights = imos::DefaultNetwork();
    network.checksum = Checksum(ByteSource(file.bytes, std::string(file.name)));
  } else {
    network.source = path;
    network.weights = imos::ReadNetwork(std::filesystem::path(path));
    network.checksum = Checksum(ByteSource(std::filesystem::path(path)));
  }
  // Networks with learned vectors keep them: the file then serves to choose the action.
  const int size = network.weights.config.action_size;
  const bool own = vectors.empty() ||
                   (network.weights.HasActionTable() && imos::ActionVectorSize(vectors) != size);
  network.action_table =
      own ? imos::ActionTable(network.weights) : imos::ReadActionTable(vectors, size);
  const nlohmann::json seconds = JsonNote(network.weights, "seconds_per_key_frame", network.source);
  for (const auto& [action, value] : seconds.items()) {
    if (value.is_number() && value.get<double>() > 0.0) network.seconds[action] = value;
  }
  const nlohmann::json seen = JsonNote(network.weights, "seen", network.source);
  for (const auto& [action, objects] : seen.items()) network.seen[action] = objects;
  return network;
}

std::vector<std::string> SynthesisNetwork::Actions() const {
  std::vector<std::string> names;
  for (const imos::Action& action : imos::Actions()) {
    if (seen.empty() || seen.contains(std::string(action.label))) names.emplace_back(action.label);
  }
  return names;
}

double SynthesisNetwork::SecondsPerKeyFrame(int action) const {
  const auto found = seconds.find(std::string(imos::Actions()[action].label));
  if (found != seconds.end()) return found->second;
  double sum = 0.0;
  for (const auto& [name, value] : seconds) sum += value;
  return seconds.empty() ? kPublishedSeconds : sum / static_cast<double>(seconds.size());
}

nlohmann::json SynthesisNetwork::ToJson() const {
  return {{"weights", source}, {"checksum", checksum}, {"notes", weights.notes}};
}

}  // namespace holdfast

namespace holdfast::imos {
namespace {

constexpr std::string_view kName = "networks/imos.safetensors";

}  // namespace

bool HasDefaultNetwork() { return HasEmbedded(kName); }

NetworkWeights DefaultNetwork() {
  const EmbeddedFile file = FindEmbedded(kName);
  const std::string name(file.name);
  return ReadNetwork(SafetensorsReader(ByteSource(file.bytes, name)), name);
}

namespace {

// Large enough for products to be compute-bound, small enough for activations to fit the cache.
constexpr int kBatch = 32;

void Check(const SynthesisRequest& request, const Network<float>& network) {
  const std::size_t count = request.starts.size();
  if (count == 0 || request.num_frames <= kHistory) {
    throw Error("synthesis", fmt::format("{} samples of {} key frames", count, request.num_frames),
                fmt::format("Request at least one sample of {} key frames", kHistory + 1));
  }
  const int steps = request.num_frames - kHistory;
  if (request.noise &&
      (request.noise->cols() != static_cast<Eigen::Index>(count) ||
       request.noise->rows() != Eigen::Index{network.Options().NoiseSize()} * steps)) {
    throw Error("synthesis",
                fmt::format("the noise is {} x {}, {} x {} is needed", request.noise->rows(),
                            request.noise->cols(), network.Options().NoiseSize() * steps, count),
                "Give one column per sample, with all steps stacked");
  }
  if (!request.roots.empty() && request.roots.size() != count) {
    throw Error("synthesis",
                fmt::format("{} root tracks for {} samples", request.roots.size(), count),
                "Give one per sample, or none");
  }
  for (std::size_t i = 0; i < count; ++i) {
    const SynthesisStart& start = request.starts[i];
    const std::string where = fmt::format("synthesis[{}]", i);
    if (start.condition.size() != network.ConditionSize()) {
      throw Error(where,
                  fmt::format("the condition has {} numbers, the networks take {}",
                              start.condition.size(), network.ConditionSize()),
                  "Compute it from the action table of the networks");
    }
    if (!start.poses.allFinite() || !start.roots.allFinite() || !start.objects.allFinite() ||
        !start.condition.allFinite()) {
      throw Error(where, "its start is not finite", "Check the clip it comes from");
    }
    if (!request.roots.empty() && request.roots[i].cols() < request.num_frames) {
      throw Error(
          where,
          fmt::format("{} roots for {} key frames", request.roots[i].cols(), request.num_frames),
          "Give the root of every key frame");
    }
  }
}

class RolloutBatch {
 public:
  RolloutBatch(const Network<float>& network, const SynthesisRequest& request,
               const ObjectOfFrame& object, int max_samples)
      : network_(network),
        request_(request),
        object_(object),
        rollout_(network, max_samples, request.num_frames),
        conditions_(network.ConditionSize(), max_samples),
        noise_(Eigen::Index{network.Options().NoiseSize()} * Steps(), max_samples),
        step_noise_(network.Options().NoiseSize(), max_samples) {}

  void Run(int first, int size, std::span<SynthesisTrack> tracks) {
    Begin(first, size, tracks);
    const int noise_size = network_.Options().NoiseSize();
    const bool given = !network_.Options().predicts_root;
    for (int f = kHistory; f < request_.num_frames; ++f) {
      step_noise_.leftCols(size) =
          noise_.block(Eigen::Index{noise_size} * (f - kHistory), 0, noise_size, size);
      rollout_.Step(step_noise_.leftCols(size));
      for (int i = 0; i < size; ++i) {
        if (given && !request_.roots.empty()) {
          rollout_.SetRoot(i, request_.roots[first + i].col(f).cast<float>());
        }
        Take(first + i, i, f, tracks[first + i]);
      }
    }
  }

 private:
  int Steps() const { return request_.num_frames - kHistory; }

  void Begin(int first, int size, std::span<SynthesisTrack> tracks) {
    for (int i = 0; i < size; ++i) {
      conditions_.col(i) = request_.starts[first + i].condition;
      noise_.col(i) = request_.noise ? request_.noise->col(first + i).eval()
                                     : wandr::DrawLatents(
                                           request_.seed, request_.first_stream + first + i,
                                           network_.Options().NoiseSize(), Steps(), request_.sigma);
    }
    rollout_.Begin(conditions_.leftCols(size));
    for (int i = 0; i < size; ++i) {
      const SynthesisStart& start = request_.starts[first + i];
      SynthesisTrack& track = tracks[first + i];
      track.raw_poses.resize(kPoseSize, request_.num_frames);
      track.poses.resize(kPoseSize, request_.num_frames);
      track.roots.resize(3, request_.num_frames);
      track.objects.resize(kObjectSize, request_.num_frames);
      for (int f = 0; f < kHistory; ++f) {
        rollout_.SetHistory(f, i, start.poses.col(f).cast<float>(),
                            start.roots.col(f).cast<float>(), start.objects.col(f).cast<float>());
        track.raw_poses.col(f) = start.poses.col(f);
        track.poses.col(f) = PoseColumn(PoseOfColumn(start.poses.col(f), start.roots.col(f)));
        track.roots.col(f) = start.roots.col(f);
        track.objects.col(f) = start.objects.col(f);
      }
    }
  }

  // Stores the output of a step for one sample, and the object there.
  void Take(int sample, int column, int f, SynthesisTrack& track) {
    const KeyFrame<float>& frame = rollout_.Frame(f);
    track.raw_poses.col(f) = frame.pose.col(column).cast<double>();
    track.roots.col(f) = frame.root.col(column).cast<double>();
    if (!track.raw_poses.col(f).allFinite() || !track.roots.col(f).allFinite()) {
      throw Error(fmt::format("synthesis[{}]", sample),
                  fmt::format("the pose of key frame {} is not finite", f),
                  "Use weights whose training did not diverge");
    }
    const wandr::Pose<double> pose = PoseOfColumn(track.raw_poses.col(f), track.roots.col(f));
    track.poses.col(f) = PoseColumn(pose);
    track.objects.col(f) = object_(sample, f, pose);
    if (!track.objects.col(f).allFinite()) {
      throw Error(fmt::format("synthesis[{}]", sample),
                  fmt::format("the object's pose of key frame {} is not finite", f),
                  "Check the function that computes it");
    }
    rollout_.SetObject(column, track.objects.col(f).cast<float>());
  }

  const Network<float>& network_;
  const SynthesisRequest& request_;
  const ObjectOfFrame& object_;
  Rollout<float> rollout_;
  Eigen::MatrixXf conditions_, noise_, step_noise_;
};

}  // namespace

SynthesisStart StartOf(const ActionSequence& sequence, ObjectRotation rotation,
                       const Eigen::Ref<const Eigen::MatrixXf>& action_table) {
  SynthesisStart start;
  start.poses = sequence.pose.topLeftCorner<kPoseSize, kHistory>();
  start.roots = sequence.transl.leftCols<kHistory>();
  for (int f = 0; f < kHistory; ++f) {
    start.objects.col(f) =
        ObjectColumn(sequence.ObjectRotation(f), sequence.object_transl.col(f), rotation);
  }
  start.condition = ConditionOf(sequence.betas, {sequence.action, sequence.object}, action_table);
  return start;
}

std::vector<SynthesisTrack> RunSynthesis(const Network<float>& network,
                                         const SynthesisRequest& request,
                                         const ObjectOfFrame& object, int threads) {
  Check(request, network);
  const int count = static_cast<int>(request.starts.size());
  const int size = std::clamp((count + threads - 1) / std::max(threads, 1), 1, kBatch);
  const int num_batches = (count + size - 1) / size;
  const int workers = std::clamp(threads, 1, num_batches);
  std::vector<SynthesisTrack> tracks(request.starts.size());
  // Each worker processes every n-th batch, so that it allocates its memory once.
  ParallelFor(workers, workers, [&](int worker) {
    RolloutBatch batch(network, request, object, size);
    for (int b = worker; b < num_batches; b += workers) {
      batch.Run(b * size, std::min(size, count - b * size), tracks);
    }
  });
  return tracks;
}

}  // namespace holdfast::imos
