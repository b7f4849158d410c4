// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/suggestion.h"
#include "python/src/bindings.h"

namespace holdfast::python {
namespace {

// The function behind an attribute of a module or class, or null.
PyCFunctionObject* FunctionOf(PyObject* item) {
  if (PyInstanceMethod_Check(item)) item = PyInstanceMethod_GET_FUNCTION(item);
  if (Py_TYPE(item) == &PyStaticMethod_Type) {
    item = py::getattr(item, "__func__").ptr();  // owned by the static method
  }
  return PyCFunction_Check(item) ? reinterpret_cast<PyCFunctionObject*>(item) : nullptr;
}

// Splits "a: int = 1, b: Tuple[int, int] = (1, 2)" at its outer commas.
std::vector<std::string> Parameters(std::string_view list) {
  std::vector<std::string> parts(1);
  int depth = 0;
  char quote = 0;
  for (const char c : list) {
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '\'' || c == '"') {
      quote = c;
    } else if (c == '[' || c == '(' || c == '{') {
      ++depth;
    } else if (c == ']' || c == ')' || c == '}') {
      --depth;
    } else if (c == ',' && depth == 0) {
      parts.emplace_back();
      continue;
    }
    if (parts.back().empty() && c == ' ') continue;
    parts.back() += c;
  }
  if (parts.back().empty()) parts.pop_back();
  return parts;
}

// "a: int = 1" without its type.
std::string WithoutType(const std::string& parameter) {
  const std::size_t type = parameter.find(':'), value = parameter.find(" = ");
  std::string name = parameter.substr(0, std::min(type, value));
  return value == std::string::npos ? name : name + "=" + parameter.substr(value + 3);
}

std::string NameOf(const std::string& parameter) {
  return parameter.substr(0, parameter.find('='));
}

// "name=default" of the entries "name : type, default value" (OptionsText) of a docstring.
std::vector<std::string> OptionsIn(std::string_view doc) {
  constexpr std::string_view kType = " : ", kDefault = ", default ";
  std::vector<std::string> options;
  while (!doc.empty()) {
    const std::string_view line = doc.substr(0, doc.find('\n'));
    doc.remove_prefix(std::min(doc.size(), line.size() + 1));
    const std::size_t type = line.find(kType), value = line.rfind(kDefault);
    if (line.starts_with(' ') || value == std::string_view::npos || type > value) continue;
    options.push_back(std::string(line.substr(0, type)) + "=" +
                      std::string(line.substr(value + kDefault.size())));
  }
  return options;
}

// Parameters without types, from the line that pybind11 begins a text with, "name(a: int = 1) ->
// str", and with the options in place of **kwargs. No value if there is no such line.
std::optional<std::vector<std::string>> ParametersOf(std::string_view doc) {
  const std::size_t line = std::min(doc.find('\n'), doc.size()), open = doc.find('(');
  const std::size_t arrow = doc.substr(0, line).rfind(") -> ");
  if (arrow == std::string_view::npos || open == std::string_view::npos || open > arrow) return {};
  std::vector<std::string> parameters;
  for (const std::string& one : Parameters(doc.substr(open + 1, arrow - open - 1))) {
    parameters.push_back(WithoutType(one));
  }
  if (parameters.empty() || parameters.back() != "**kwargs") return parameters;
  std::vector<std::string> options = OptionsIn(doc.substr(line));
  std::erase_if(options, [&](const std::string& option) {
    return std::ranges::count(parameters, NameOf(option), NameOf) > 0;
  });
  if (options.empty()) return parameters;
  parameters.pop_back();
  if (std::ranges::count(parameters, "*") == 0) parameters.emplace_back("*");
  parameters.insert(parameters.end(), options.begin(), options.end());
  return parameters;
}

// What a function takes by keyword.
struct Keywords {
  std::string function;  // "Clip.resample"
  std::vector<std::string> names;
};

// By the object that CPython passes to the function. It is not destroyed before the functions.
std::unordered_map<const PyObject*, Keywords>& KnownKeywords() {
  static auto* const known = new std::unordered_map<const PyObject*, Keywords>;
  return *known;
}

PyCFunctionWithKeywords pybind11_call = nullptr;  // the same for all functions

// Calls a function, or raises TypeError for an unknown keyword argument, which pybind11 would not
// name.
PyObject* CallWithKnownKeywords(PyObject* self, PyObject* arguments, PyObject* keywords) {
  PyObject* key = nullptr;
  Py_ssize_t place = 0;
  while (keywords != nullptr && PyDict_Next(keywords, &place, &key, nullptr) != 0) {
    const char* const given = PyUnicode_AsUTF8(key);
    if (given == nullptr) return nullptr;
    const auto& [function, names] = KnownKeywords().at(self);
    if (std::ranges::count(names, given) > 0) continue;
    // The beginning of a name is near to it.
    const auto longer =
        std::ranges::find_if(names, [&](const auto& name) { return name.starts_with(given); });
    const std::string text = fmt::format(
        "{}() got an unexpected keyword argument '{}'. {}help(holdfast.{}) lists all", function,
        given, Suggestion(longer == names.end() ? given : *longer, names), function);
    PyErr_SetString(PyExc_TypeError, text.c_str());
    return nullptr;
  }
  return pybind11_call(self, arguments, keywords);
}

void Check(PyCFunctionObject& function, const std::string& name,
           const std::vector<std::string>& parameters) {
  const bool any = std::ranges::any_of(
      parameters, [](const std::string& parameter) { return parameter.starts_with("**"); });
  if (any || function.m_ml->ml_flags != (METH_VARARGS | METH_KEYWORDS)) return;
  Keywords& known = KnownKeywords()[function.m_self];
  known.function = name;
  for (const std::string& parameter : parameters) {
    if (parameter != "*") known.names.push_back(NameOf(parameter));
  }
  pybind11_call = reinterpret_cast<PyCFunctionWithKeywords>(
      reinterpret_cast<void (*)()>(function.m_ml->ml_meth));
  function.m_ml->ml_meth =
      reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(&CallWithKnownKeywords));
}

// Python reads signatures from texts that begin with "name(a=1)\n--\n\n".
void Give(PyCFunctionObject& function, const std::string& name) {
  const char*& doc = function.m_ml->ml_doc;
  const std::string_view told = doc == nullptr ? "" : doc;
  const auto parameters = ParametersOf(told);
  if (!parameters) return;
  Check(function, name, *parameters);
  const std::size_t rest = told.find_first_not_of('\n', told.find('\n'));
  const std::string text =
      fmt::format("{}({})\n--\n\n{}", function.m_ml->ml_name, fmt::join(*parameters, ", "),
                  rest == std::string_view::npos ? "" : told.substr(rest));
  std::free(const_cast<char*>(doc));  // as pybind11 frees it
  doc = strdup(text.c_str());
}

}  // namespace

void GiveSignatures(py::module_& module) {
  for (const auto& [name, item] : py::dict(module.attr("__dict__"))) {
    const std::string named = py::str(name);
    if (PyCFunctionObject* const function = FunctionOf(item.ptr())) Give(*function, named);
    if (!PyType_Check(item.ptr())) continue;
    for (const auto& [key, member] : py::dict(py::getattr(item, "__dict__"))) {
      const std::string method = py::str(key);
      if (PyCFunctionObject* const function = FunctionOf(member.ptr())) {
        Give(*function, method == "__init__" ? named : fmt::format("{}.{}", named, method));
      }
    }
  }
}

}  // namespace holdfast::python
