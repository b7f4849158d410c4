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
      {"drink", {"mug", "wineglass", "bottle", "bowl"}, 1.3, "rim to the mouth, tilted"},
      {"eat", {"apple", "banana"}, 1.0, "bites"},
      {"pass",
       {"mug", "apple", "bottle", "phone", "banana", "camera", "cube", "sphere", "cylinder",
        "wineglass", "teapot", "flashlight", "lightbulb", "toothbrush", "hammer", "bowl"},
       1.6,
       "held out to a partner"},
      {"inspect",
       {"cube", "sphere", "cylinder", "lightbulb", "apple", "camera", "mug", "phone", "bottle",
        "flashlight", "wineglass"},
       1.4,
       "turned in front of the eyes"},
      {"lift",
       {"cube", "cylinder", "bottle", "mug", "teapot", "bowl", "hammer", "apple", "wineglass",
        "fryingpan"},
       0.9,
       "straight up and held"},
      {"call", {"phone"}, 1.0, "phone at the ear"},
      {"takepicture", {"camera", "phone"}, 1.0, "lens forward, in front of the eyes"},
      {"brush", {"toothbrush"}, 1.0, "small strokes at the mouth"},
      {"toast", {"wineglass", "mug"}, 1.0, "raised to a partner, then a sip"},
      {"pour", {"teapot", "bottle", "mug"}, 1.1, "spout or rim tilted down"},
      {"offhand",
       {"bottle", "banana", "apple", "flashlight", "cylinder"},
       1.3,
       "from one hand to the other"},
      {"shake", {"bottle", "cylinder"}, 0.8, "up and down, fast"},
      {"switchON", {"flashlight"}, 0.7, "pointed forward"},
      {"use", {"hammer"}, 0.7, "blows"},
      {"chop", {"knife"}, 0.7, "on the table"},
      {"cook", {"fryingpan"}, 0.7, "swayed"},
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
