// SPDX-License-Identifier: MIT
#include "generator/actions/action_catalog.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/suggestion.h"

namespace holdfast {
std::span<const ScriptedAction> ScriptedActions() {
  static const std::vector<ScriptedAction> actions = {
      {"drink", {"mug", "wineglass", "bottle", "bowl"}, 1.3},
      {"eat", {"apple", "banana"}, 1.0},
      {"pass",
       {"mug", "apple", "bottle", "phone", "banana", "camera", "cube", "sphere", "cylinder",
        "wineglass", "teapot", "flashlight", "lightbulb", "toothbrush", "hammer", "bowl"},
       1.6},
      {"inspect",
       {"cube", "sphere", "cylinder", "lightbulb", "apple", "camera", "mug", "phone", "bottle",
        "flashlight", "wineglass"},
       1.4},
      {"lift",
       {"cube", "cylinder", "bottle", "mug", "teapot", "bowl", "hammer", "apple", "wineglass",
        "fryingpan"},
       0.9},
      {"call", {"phone"}, 1.0},
      {"takepicture", {"camera", "phone"}, 1.0},
      {"brush", {"toothbrush"}, 1.0},
      {"toast", {"wineglass", "mug"}, 1.0},
      {"pour", {"teapot", "bottle", "mug"}, 1.1},
      {"offhand", {"bottle", "banana", "apple", "flashlight", "cylinder"}, 1.3},
      {"shake", {"bottle", "cylinder"}, 0.8},
      {"switchON", {"flashlight"}, 0.7},
      {"use", {"hammer"}, 0.7},
      {"chop", {"knife"}, 0.7},
      {"cook", {"fryingpan"}, 0.7},
  };
  return actions;
}

std::string ScriptedActionNames() {
  std::vector<std::string_view> names;
  for (const ScriptedAction& action : ScriptedActions()) names.push_back(action.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

const ScriptedAction& FindScriptedAction(std::string_view name) {
  const std::span<const ScriptedAction> all = ScriptedActions();
  const auto found = std::ranges::find(all, name, &ScriptedAction::name);
  if (found != all.end()) return *found;
  const auto nearest = std::ranges::min_element(
      all, {}, [&](const ScriptedAction& action) { return EditDistance(name, action.name); });
  throw Error(
      std::string(name), "is not an action that can be generated",
      fmt::format("Did you mean '{}'? Known actions: {}", nearest->name, ScriptedActionNames()));
}

}  // namespace holdfast
