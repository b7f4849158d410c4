// SPDX-License-Identifier: MIT
#include <map>
#include <span>
#include <string>
#include <vector>

#include <pybind11/stl.h>

#include "generator/body/rest_pelvis_note.h"
#include "generator/imos/action_set.h"
#include "generator/imos/recognition.h"
#include "generator/imos/weights.h"
#include "generator/nn/network_weights.h"
#include "generator/wandr/corpus.h"
#include "generator/wandr/network.h"
#include "generator/wandr/reach_protocol.h"
#include "geometry/error.h"
#include "python/src/fit.h"
#include "python/src/numpy.h"
#include "python/src/run.h"

// Functions for holdfast.train: data sets, initial networks, and the protocol that evaluates a
// network in training. Names begin with "_", since they are private to the package.
namespace holdfast::python {
namespace {

using namespace py::literals;
using Texts = std::map<std::string, std::string>;

template <typename T>
py::array_t<T> Copied(const std::vector<T>& values, const Shape& shape) {
  py::array_t<T> array(shape);
  std::copy(values.begin(), values.end(), array.mutable_data());
  return array;
}

py::dict ArraysOf(const nn::TensorMap& tensors, std::string_view without = "") {
  py::dict arrays;
  for (const auto& [name, tensor] : tensors) {
    arrays[py::str(name.substr(without.size()))] =
        Copied(tensor.values, {tensor.shape.begin(), tensor.shape.end()});
  }
  return arrays;
}

py::dict ArraysOf(const nn::AnyWeights& weights) {
  nn::TensorMap tensors;
  nn::AddTensors(weights, "net", tensors);
  return ArraysOf(tensors, "net.");
}

BodyMeasures MeasuresOf(const py::object& body) {
  return MeasureBody(*ModelOf(body), Eigen::VectorXd());
}

Side SideOf(const std::string& wrist) {
  return Choice<Side>(wrist, "wrist", {{"right", Side::kRight}, {"left", Side::kLeft}});
}

// (states (F, 135), goals (K, 3), their frames (K,), whether it was generated for goals).
py::tuple ClipTuple(const wandr::CorpusClip& clip) {
  const auto frames = static_cast<Eigen::Index>(clip.poses.size());
  const auto count = static_cast<Eigen::Index>(clip.goals.size());
  wandr::StateMatrix<float> states(wandr::kStateSize, frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    wandr::WriteState<float>(clip.poses[static_cast<std::size_t>(t)], states.col(t));
  }
  Eigen::Matrix3Xd goals(3, count);
  std::vector<int> due;
  for (const wandr::Waypoint& goal : clip.goals) {
    goals.col(static_cast<Eigen::Index>(due.size())) = goal.position;
    due.push_back(goal.frame);
  }
  return py::make_tuple(Rows(states), Rows(goals), Copied(due, {count}), clip.made);
}

py::dict ReadCorpus(const std::vector<std::string>& folders, const py::object& body,
                    double made_hours, bool mirror, const std::string& wrist,
                    const py::object& progress) {
  const Side side = SideOf(wrist);
  const Eigen::Matrix3Xd rest_joints = MeasuresOf(body).rest_joints;
  wandr::Corpus corpus;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    corpus = wandr::ReadCorpus({folders.begin(), folders.end()}, rest_joints, made_hours, mirror,
                               side, [&](int done, int total) {
                                 if (go_on && !go_on("reading clips", done, total)) throw Stopped();
                               });
  });
  LogNotes(corpus.notes);
  py::list clips;
  for (const wandr::CorpusClip& clip : corpus.clips) clips.append(ClipTuple(clip));
  nn::TensorMap statistics;
  wandr::AddTensors(corpus.statistics, statistics);
  return py::dict("clips"_a = clips, "statistics"_a = ArraysOf(statistics),
                  "captured_frames"_a = corpus.captured_frames,
                  "made_frames"_a = corpus.made_frames);
}

py::list ReadClips(const std::string& folder, const std::string& wrist) {
  py::list clips;
  for (const wandr::CorpusClip& clip : wandr::ReadCorpusClips(folder, SideOf(wrist), nullptr)) {
    clips.append(ClipTuple(clip));
  }
  return clips;
}

// Runs the adaptive protocol with one sample per goal, on starts not used in any table.
py::dict EvaluateReach(const std::string& path, const py::object& body, const std::string& wrist,
                       int threads) {
  const BodyMeasures measures = MeasuresOf(body);
  wandr::ReachProtocol protocol;
  protocol.num_samples = 1;
  protocol.seed = 2;
  protocol.intention.wrist = SideOf(wrist);
  const wandr::ReachSummary summary =
      RunAside([path, measures, protocol, threads = ThreadsOf(threads)] {
        const wandr::NetworkWeights weights = wandr::ReadNetwork(path);
        const wandr::Network<float> network(weights);
        const auto starts = wandr::AsFloat(
            wandr::ComposedStarts(measures, wandr::Normalizer<double>(weights.statistics)));
        return wandr::Summarize(wandr::RunReachProtocol(
            network, wandr::BoneOffsetsOf(measures.rest_joints).Cast<float>(), starts, protocol,
            threads));
      });
  return py::dict("success"_a = summary.success, "distance_m"_a = summary.distance_mean_m,
                  "distance_median_m"_a = summary.distance_median_m, "skating"_a = summary.skating,
                  "airborne"_a = summary.airborne, "acceleration"_a = summary.acceleration_m_s2);
}

// Training data of IMoS networks, one row per sequence.
py::dict SequenceArrays(std::span<const imos::ActionSequence> sequences) {
  constexpr py::ssize_t kFrames = imos::kNumKeyFrames, kJoints = imos::kNumPoseJoints;
  const auto count = static_cast<py::ssize_t>(sequences.size());
  py::dict arrays;
  const auto add = [&](const char* name, Shape shape, const auto& fill) {
    shape.insert(shape.begin(), count);
    py::array_t<float> array(shape);
    const py::ssize_t size = count > 0 ? array.size() / count : 0;
    for (py::ssize_t b = 0; b < count; ++b) {
      fill(sequences[static_cast<std::size_t>(b)],
           Eigen::Map<Eigen::VectorXf>(array.mutable_data() + b * size, size));
    }
    arrays[name] = array;
  };
  using Sequence = imos::ActionSequence;
  using Row = Eigen::Map<Eigen::VectorXf>;
  const auto copy = [](const auto& matrix, Row row) {
    Eigen::Map<Eigen::MatrixXf>(row.data(), matrix.rows(), matrix.cols()) =
        matrix.template cast<float>();
  };
  add("pose", {kFrames, imos::kPoseSize},
      [&](const Sequence& s, Row row) { copy(s.pose.topRows<imos::kPoseSize>(), row); });
  add("transl", {kFrames, 3}, [&](const Sequence& s, Row row) { copy(s.transl, row); });
  add("joints", {kFrames, kJoints, 3}, [&](const Sequence& s, Row row) { copy(s.joints, row); });
  add("object_T", {kFrames, 3}, [&](const Sequence& s, Row row) { copy(s.object_transl, row); });
  add("object_R", {kFrames, 3, 3}, [](const Sequence& s, Row row) {
    for (int k = 0; k < imos::kNumKeyFrames; ++k) {
      Eigen::Map<Eigen::Matrix3f>(row.data() + 9 * k) =
          s.ObjectRotation(k).transpose().cast<float>();
    }
  });
  const auto carried = [&](const char* name, imos::Carrier carrier) {
    add(name, {kFrames}, [carrier](const Sequence& s, Row row) {
      for (std::size_t k = 0; k < s.carriers.size(); ++k) {
        row[static_cast<Eigen::Index>(k)] = s.carriers[k] == carrier ? 1.0f : 0.0f;
      }
    });
  };
  carried("by_left", imos::Carrier::kLeftWrist);
  carried("by_right", imos::Carrier::kRightWrist);
  add("bones", {kJoints, 3},
      [&](const Sequence& s, Row row) { copy(wandr::BoneOffsetsOf(s.rest_joints).offset, row); });
  add("betas", {imos::kNumBetas}, [&](const Sequence& s, Row row) { copy(s.betas, row); });
  std::vector<int> action, object;
  std::vector<double> seconds;
  std::vector<bool> mirrored;
  for (const Sequence& s : sequences) {
    if (s.NumKeyFrames() != imos::kNumKeyFrames) {
      throw Error(s.source.empty() ? s.name : s.source,
                  fmt::format("has {} key frames", s.NumKeyFrames()),
                  fmt::format("{} are needed", imos::kNumKeyFrames));
    }
    action.push_back(s.action);
    object.push_back(s.object);
    seconds.push_back(s.seconds_per_key_frame);
    mirrored.push_back(s.mirrored);
  }
  arrays["action"] = Copied(action, {count});
  arrays["object"] = Copied(object, {count});
  arrays["seconds_per_key_frame"] = Copied(seconds, {count});
  arrays["mirrored"] = mirrored;
  return arrays;
}

py::dict ReadActionSet(const std::vector<std::string>& folders, const py::object& body,
                       const std::string& key_frames, const std::vector<std::string>& validation,
                       const std::vector<std::string>& held_out,
                       const std::vector<std::string>& without, bool mirror, int threads,
                       const py::object& progress) {
  imos::ActionSetOptions options;
  options.rule = Choice<imos::KeyFrameRule>(
      key_frames, "key_frames",
      {{"whole", imos::KeyFrameRule::kWhole}, {"paper", imos::KeyFrameRule::kPaper}});
  options.validation = validation;
  options.test = held_out;
  options.without = without;
  options.threads = ThreadsOf(threads);
  const ModelPtr model = ModelOf(body);
  imos::ActionSet set;
  RunWithProgress(progress, [&](const StagedProgress& go_on) {
    set = imos::ReadActionSet({folders.begin(), folders.end()}, model, options,
                              [&](int done, int total) {
                                if (go_on && !go_on("reading clips", done, total)) throw Stopped();
                              });
    const std::size_t count = mirror ? set.train.size() : 0;
    for (std::size_t k = 0; k < count; ++k) set.train.push_back(imos::Mirrored(set.train[k]));
  });
  return py::dict("train"_a = SequenceArrays(set.train),
                  "validation"_a = SequenceArrays(set.validation),
                  "test"_a = SequenceArrays(set.test), "notes"_a = set.notes);
}

py::dict ImosStart(Texts config, std::uint64_t seed) {
  return ArraysOf(
      imos::RandomNetwork(imos::ConfigFromTexts(config, "configuration"), seed, true).tensors);
}

py::tuple Vocabulary() {
  py::list actions, objects;
  for (const imos::Action& action : imos::Actions()) actions.append(action.label);
  for (const std::string_view object : imos::Objects()) objects.append(object);
  return py::make_tuple(actions, objects);
}

}  // namespace

void BindTraining(py::module_& module) {
  module.def(
      "_body_measures",
      [](const py::object& body) {
        const BodyMeasures measures = MeasuresOf(body);
        return py::make_tuple(Rows(measures.rest_joints), measures.sole_y);
      },
      "body"_a = py::none(),
      "(rest joints (55, 3), height of the soles in the rest pose), meters, of the mean shape.");
  module.def("_read_corpus", &ReadCorpus, "folders"_a, py::kw_only(), "body"_a = py::none(),
             "made_hours"_a = 1e6, "mirror"_a = true, "wrist"_a = "right",
             "progress"_a = py::none(),
             "Clips to train WANDR on (captured ones mirrored too), at 30 fps: a list of (states "
             "(F, 135), goals (K, 3) meters, their frames (K,), whether generated for goals), with "
             "statistics of the features by name.");
  module.def("_read_clips", &ReadClips, "folder"_a, "wrist"_a = "right",
             "The clips of one folder as _read_corpus has them, no mirror images.");
  module.def("_evaluate_reach", &EvaluateReach, "weights"_a, py::kw_only(), "body"_a = py::none(),
             "wrist"_a = "right", "threads"_a = 1,
             "A network's means in the adaptive protocol, one sample a goal, on starts that no "
             "table is made of: shares of goals reached, meters left, ...");
  module.def(
      "_random_residual",
      [](int input, int latent, int width, int blocks, int output, std::uint64_t seed) {
        return ArraysOf(nn::RandomResidual(input, latent, width, blocks, output, seed));
      },
      "input"_a, "latent"_a, "width"_a, "blocks"_a, "output"_a, "seed"_a,
      "Tensors of a residual network to begin with, by name; the same everywhere.");
  module.def(
      "_random_chain",
      [](int input, int output, std::uint64_t seed) {
        return ArraysOf(nn::RandomMlp(input, nn::TaperedWidths(input, output), output, seed));
      },
      "input"_a, "output"_a, "seed"_a,
      "The same of the published chain of layers, whose widths go evenly from input to output.");
  module.def("_read_action_set", &ReadActionSet, "folders"_a, py::kw_only(), "body"_a = py::none(),
             "key_frames"_a = "whole", "validation"_a = std::vector<std::string>{"s1"},
             "held_out"_a = std::vector<std::string>{"s10"},
             "without"_a = std::vector<std::string>(), "mirror"_a = false, "threads"_a = 0,
             "progress"_a = py::none(),
             "Sequences of 15 key frames by what they are for (train, validation, test), as arrays "
             "of one row a sequence, and notes on files left out. mirror: training sequences a "
             "second time, sides exchanged, behind the others.");
  module.def(
      "_imos_config",
      [](bool paper) {
        return imos::ConfigTexts(paper ? imos::PaperConfig() : imos::CompactConfig());
      },
      "paper"_a, "Configuration of the published networks or of ours, as in a weights file.");
  module.def("_imos_start", &ImosStart, "config"_a, "seed"_a,
             "Tensors of networks of IMoS by the published start, with the present encoder.");
  module.def(
      "_recognizer_start",
      [](std::uint64_t seed) { return ArraysOf(imos::RandomRecognizer(seed)); }, "seed"_a,
      "Tensors of a recognizer to begin with.");
  module.def(
      "_read_action_table",
      [](const std::string& path, int size) {
        return Rows(Eigen::MatrixXf(imos::ReadActionTable(path, size).transpose()));
      },
      "path"_a, "size"_a, "Embeddings of the 29 actions (29, size) that a file has by label.");
  module.def("_vocabulary", &Vocabulary, "(labels of the 29 actions, names of the 54 objects).");
  module.def(
      "_rest_pelvis_notes",
      [] {
        Texts notes;
        NoteRestPelvis(notes);
        return notes;
      },
      "Texts that a network must carry which is trained on the embedded body.");
  module.def("_old_pelvis_warning", &OldPelvisWarning, "source"_a, "notes"_a,
             "What to say of weights trained when the embedded body rested elsewhere, or None.");
}

}  // namespace holdfast::python
