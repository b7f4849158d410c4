// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

namespace holdfast {

/// Ranges of numbers read from files of any format. They far exceed any human motion, and keep
/// derived squares and counts finite.
inline constexpr double kMaxMeters = 1e5;
inline constexpr double kMaxRadians = 1e3;
inline constexpr double kMaxBeta = 1e3;
inline constexpr double kLowestFrameRate = 1.0;  // Hz
inline constexpr double kHighestFrameRate = 1e4;

/// Remedies for positions and angles out of range.
inline constexpr std::string_view kMetersRemedy =
    "Positions are meters, within 100,000: check the units";
inline constexpr std::string_view kRadiansRemedy =
    "Angles are radians, within 1,000: check the units";

inline bool IsWithin(double value, double most) { return value >= -most && value <= most; }

/// Throws Error ("where[field]", with value and column) for the first number that is NaN or beyond
/// +-`most`. `column_is`: the meaning of a column, "frame". RequireInRange of clips, motions and
/// meshes is declared with those types; readers call it, and so should other code that fills them.
void RequireWithin(const Eigen::Ref<const Eigen::MatrixXd>& values, double most,
                   std::string_view where, std::string_view field, std::string_view column_is,
                   std::string_view remedy);
void RequireFrameRate(double rate, std::string_view where);

/// Returns the index of the first value that is NaN or beyond +-`most`, if any. Runs at memory
/// speed.
std::optional<std::size_t> FirstBeyond(std::span<const float> values, double most);
std::optional<std::size_t> FirstBeyond(std::span<const double> values, double most);

/// The valid range of a number. `positive` excludes 0.
struct OptionRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool positive = false;

  bool Contains(double value) const {
    return value >= low && value <= high && (!positive || (value > 0.0 && std::isfinite(value)));
  }
};
inline constexpr OptionRange kPositive{.low = 0.0, .positive = true};
inline constexpr OptionRange kNonNegative{.low = 0.0};

/// A choice among words, for any underlying type.
struct OptionChoice {
  std::vector<std::string> words;
  std::function<std::size_t()> get;      ///< index into `words`
  std::function<void(std::size_t)> set;  ///< the same
};

/// A number whose unit differs from that of the variable: value = *variable / unit.
struct ScaledNumber {
  double* variable;
  double unit;  ///< of the option in the variable's unit: 1e-3 for millimeters in meters
};

/// One option of a job. It is declared once, and used by the command line, config files, Python,
/// metrics.json and the documentation.
struct Option {
  std::string name;          ///< name with unit, in Python and JSON: "contact_threshold_mm"
  std::string flag;          ///< name on the command line: "--contact-threshold"
  std::string help;          ///< one or more sentences, without a period at the end
  std::string group;         ///< heading in --help; empty: none
  std::string default_text;  ///< text for an unset optional value: "by the distance"
  OptionRange range;
  std::variant<bool*, int*, double*, std::string*, std::optional<int>*, std::optional<double>*,
               std::vector<int>*, std::pair<int, int>*, ScaledNumber, OptionChoice>
      value;
};

/// The options of a job, bound to its variables. The job must outlive the table.
///
///   OptionTable OptionsOf(FitJob& job) {
///     OptionTable table;
///     table.Choice("hand", job.hand, {{"right", Side::kRight}, {"left", Side::kLeft}}, "...");
///     table.Number("contact_threshold", "mm", job.threshold_mm, kPositive, "...");
///     return table;
///   }
class OptionTable {
 public:
  /// Sets the group of the options declared next.
  void Group(std::string heading) { group_ = std::move(heading); }

  /// Adds a boolean. If the default is true, the command line has --no-NAME.
  void Flag(const std::string& name, bool& variable, std::string help);
  /// Adds a number (int or double). `unit` is empty for unitless numbers.
  template <typename T>
  void Number(const std::string& name, const std::string& unit, T& variable, OptionRange range,
              std::string help) {
    Add(name, unit, range, std::move(help)).value = &variable;
  }
  void Number(const std::string& name, const std::string& unit, ScaledNumber variable,
              OptionRange range, std::string help) {
    Add(name, unit, range, std::move(help)).value = variable;
  }
  template <typename T>
  void Number(const std::string& name, const std::string& unit, std::optional<T>& variable,
              OptionRange range, std::string default_text, std::string help) {
    Option& option = Add(name, unit, range, std::move(help));
    option.value = &variable;
    option.default_text = std::move(default_text);
  }
  /// Adds a list of integers >= 0. `flag` is the name on the command line.
  void Frames(const std::string& name, std::string flag, std::vector<int>& variable,
              std::string help);
  /// Adds two integers: "640x480" on the command line, (640, 480) in Python.
  void Pair(const std::string& name, std::pair<int, int>& variable, OptionRange range,
            std::string help);
  void Text(const std::string& name, std::string& variable, std::string help);
  /// Adds a choice of words, each with its value.
  template <typename T>
  void Choice(const std::string& name, T& variable,
              const std::vector<std::pair<std::string, T>>& choices, std::string help) {
    OptionChoice choice;
    std::vector<T> values;
    for (const auto& [word, value] : choices) {
      choice.words.push_back(word);
      values.push_back(value);
    }
    choice.get = [&variable, values] {
      std::size_t i = 0;
      while (i + 1 < values.size() && !(values[i] == variable)) ++i;
      return i;
    };
    choice.set = [&variable, values](std::size_t i) { variable = values[i]; };
    Add(name, "", {}, std::move(help)).value = std::move(choice);
  }

  const std::vector<Option>& All() const { return options_; }
  /// Returns null if no option has this name.
  const Option* Find(const std::string& name) const;
  /// Returns the table without these options, or with only these.
  OptionTable Without(const std::vector<std::string>& names) const;
  OptionTable Only(const std::vector<std::string>& names) const;

 private:
  Option& Add(const std::string& name, const std::string& unit, OptionRange range,
              std::string help);

  std::string group_;
  std::vector<Option> options_;
};

/// Returns the values of all options by name, as recorded in metrics.json; null for unset
/// optionals.
nlohmann::json OptionsJson(const OptionTable& table);

/// Returns entries of the section "Parameters" of a docstring in NumPy's style:
/// "name : int, 1 to 10, default 3" and an indented line with the help text.
std::string OptionsText(const OptionTable& table);

}  // namespace holdfast
