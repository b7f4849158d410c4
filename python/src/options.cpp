// SPDX-License-Identifier: MIT
#include "geometry/options.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pybind11/stl.h>

#include "generator/body/hand_onto_body.h"
#include "geometry/export/export_clip.h"
#include "geometry/import/import_file.h"
#include "geometry/render/clip_pictures.h"
#include "geometry/report/report_page.h"
#include "python/src/bindings.h"
#include "python/src/numpy.h"
#include "solver/carry/refine.h"
#include "solver/carry/run_fit.h"
#include "solver/carry/standing_grasp.h"
#include "solver/markers/keypoint_hand.h"
#include "solver/markers/solve_markers.h"
#include "solver/reach/reach_options.h"
#include "solver/robot/transfer_to_robot.h"
#include "solver/score/clip_score.h"
#include "solver/synthesis/synthesize.h"
#include "solver/transfer/transfer.h"

namespace holdfast::python {
using namespace py::literals;
namespace {

[[noreturn]] void WrongType(const Option& option, const char* expected, const py::handle& given) {
  throw py::type_error(
      fmt::format("{}: expected {}, got {}", option.name, expected, TypeText(given)));
}

// Converts a value to a C++ number or bool; throws TypeError if that is not possible.
template <typename T>
T Converted(const Option& option, const char* expected, const py::handle& given) {
  try {
    return given.cast<T>();
  } catch (const py::cast_error&) {
    WrongType(option, expected, given);
  }
}

template <typename T>
T InRange(const Option& option, const py::handle& given) {
  const T value =
      Converted<T>(option, std::is_same_v<T, int> ? "a whole number" : "a number", given);
  const OptionRange& range = option.range;
  const auto number = static_cast<double>(value);
  if (range.Contains(number)) return value;
  std::string expected = fmt::format("{:g} to {:g}", range.low, range.high);
  if (!std::isfinite(range.high)) expected = fmt::format("{:g} or more", range.low);
  if (range.positive) expected = "more than 0";
  if (std::isnan(number)) expected = "a number";
  throw py::value_error(fmt::format("{}: expected {}, got {}", option.name, expected, value));
}

// Sets one option to a Python value.
struct Set {
  const Option& option;
  const py::handle& given;

  void operator()(bool* value) const { *value = Converted<bool>(option, "True or False", given); }
  void operator()(int* value) const { *value = InRange<int>(option, given); }
  void operator()(double* value) const { *value = InRange<double>(option, given); }
  void operator()(std::string* value) const {
    if (!IsPath(given)) WrongType(option, "a str", given);
    *value = py::str(given);
  }
  template <typename T>
  void operator()(std::optional<T>* value) const {
    *value = given.is_none() ? std::nullopt : std::optional<T>(InRange<T>(option, given));
  }
  void operator()(std::vector<int>* value) const {
    value->clear();
    if (given.is_none()) return;
    const py::array_t<int> numbers = Integers(given, option.name.c_str(), {-1});
    value->assign(numbers.data(), numbers.data() + numbers.size());
  }
  void operator()(std::pair<int, int>* value) const {
    const auto numbers = Converted<std::pair<int, int>>(option, "two whole numbers", given);
    for (const int number : {numbers.first, numbers.second}) {
      if (option.range.Contains(number)) continue;
      throw py::value_error(fmt::format("{}: expected two numbers from {:g} to {:g}, got ({}, {})",
                                        option.name, option.range.low, option.range.high,
                                        numbers.first, numbers.second));
    }
    *value = numbers;
  }
  void operator()(const ScaledNumber& number) const {
    *number.variable = number.unit * InRange<double>(option, given);
  }
  void operator()(const OptionChoice& choice) const {
    if (!py::isinstance<py::str>(given)) WrongType(option, "a str", given);
    const std::string word = py::str(given);
    const auto found = std::ranges::find(choice.words, word);
    if (found == choice.words.end()) {
      throw py::value_error(fmt::format("{}: expected one of '{}', got '{}'", option.name,
                                        fmt::join(choice.words, "', '"), word));
    }
    choice.set(static_cast<std::size_t>(found - choice.words.begin()));
  }
};

}  // namespace

std::string PythonText(const std::string& text) {
  const auto is_letter = [&](std::size_t i) {
    return i < text.size() && std::islower(static_cast<unsigned char>(text[i])) != 0;
  };
  std::string said;
  bool option = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool first = i == 0 || text[i - 1] == ' ' || text[i - 1] == '(';
    if (first && text.compare(i, 2, "--") == 0 && is_letter(i + 2)) {
      option = true;
      ++i;
      continue;
    }
    option = option && (is_letter(i) || text[i] == '-');
    said += option && text[i] == '-' ? '_' : text[i];
  }
  return said;
}

std::string WithOptions(std::string_view doc, const OptionTable& table) {
  constexpr std::string_view kPlace = "@options\n";
  std::string text(doc);
  return text.replace(text.find(kPlace), kPlace.size(), PythonText(OptionsText(table)));
}

void SetOptions(const py::kwargs& given, const OptionTable& table) {
  for (const auto& [key, value] : given) {
    const std::string name = py::str(key);
    const Option* const option = table.Find(name);
    if (option == nullptr) throw py::type_error(fmt::format("unknown option '{}'", name));
    const py::handle handle = value;
    std::visit(Set{*option, handle}, option->value);
  }
}

void BindOptions(py::module_& module) {
  module.def(
      "options",
      [](const std::string& job) {
        FitJob fit;
        GraspJob grasp;
        ReachJob reach;
        SynthesisJob synthesize;
        RefineOptions refine;
        TransferOptions transfer;
        ScoreOptions score;
        SolveMarkersOptions solve;
        KeypointOptions keypoints;
        RobotTransferOptions robot;
        ExportOptions exported;
        ImportFileOptions import;
        ClipPictureOptions render;
        ReportPageOptions report;
        ConvertOptions convert;
        const std::map<std::string, OptionTable> tables = {
            {"fit", OptionsOf(fit)},
            {"grasp", OptionsOf(grasp)},
            {"reach", OptionsOf(reach)},
            {"synthesize", OptionsOf(synthesize)},
            {"refine", OptionsOf(refine)},
            {"transfer", OptionsOf(transfer)},
            {"score", OptionsOf(score)},
            {"solve_markers", OptionsOf(solve)},
            {"solve_keypoints", OptionsOf(keypoints)},
            {"export", OptionsOf(exported)},
            {"render", OptionsOf(render)},
            {"report", OptionsOf(report)},
            {"convert", OptionsOf(convert)},
            {"transfer_to_robot", OptionsOf(robot)},
            {"import_motion", OptionsOf(import).Without({"fps"})}};
        const auto found = tables.find(job);
        if (found == tables.end()) {
          std::string known;
          for (const auto& [name, table] : tables) known += fmt::format("'{}', ", name);
          throw py::value_error(fmt::format("job: expected one of {}got '{}'", known, job));
        }
        const py::dict defaults = ToPython(OptionsJson(found->second));
        py::dict options;
        for (const Option& option : found->second.All()) {
          py::dict told("default"_a = defaults[option.name.c_str()], "flag"_a = option.flag,
                        "help"_a = option.help);
          if (const auto* choice = std::get_if<OptionChoice>(&option.value)) {
            told["choices"] = py::cast(choice->words);
          } else {
            told["range"] = py::make_tuple(option.range.low, option.range.high);
          }
          options[option.name.c_str()] = told;
        }
        return options;
      },
      "job"_a,
      R"(Describes the options that a function takes by name.

Parameters
----------
job : str
    'convert', 'export', 'fit' (also of offhand()), 'grasp' (also of grasps()), 'import_motion'
    (also of Clip.load()), 'reach', 'refine', 'render', 'report', 'score', 'solve_keypoints',
    'solve_markers', 'synthesize', 'transfer' or 'transfer_to_robot'.

Returns
-------
dict
    {name: {'default', 'flag' of the command line, 'help', and 'choices' (list of str) or 'range'
    (min, max)}}.

Examples
--------
>>> holdfast.options('fit')['contact_threshold_mm']['default']
10.0
)");
}

}  // namespace holdfast::python
