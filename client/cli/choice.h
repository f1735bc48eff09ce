#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>

#include "binpose/v1/types.pb.h"

namespace binpose::client::cli {

/// Adds an option whose value is one of a few words, each standing for a value of `chosen`.
template <typename Value>
CLI::Option* add_choice(CLI::App& command, const std::string& name, Value& chosen,
                        const std::map<std::string, Value>& values, const std::string& help) {
  std::string words;
  for (const auto& [word, value] : values) words += (words.empty() ? "" : "|") + word;
  CLI::Validator is_known(
      [values, words](const std::string& word) {
        return values.contains(word) ? std::string() : "\"" + word + "\" is not one of " + words;
      },
      "");
  return command
      .add_option_function<std::string>(
          name, [&chosen, values](const std::string& word) { chosen = values.at(word); }, help)
      ->check(is_known)
      ->type_name(words);
}

/// The units by the words that stand for them.
inline std::map<std::string, v1::LengthUnit> length_units() {
  return {{"mm", v1::LENGTH_UNIT_MILLIMETRE}, {"m", v1::LENGTH_UNIT_METRE}};
}

/// Adds the required option --unit.
inline void add_unit(CLI::App& command, v1::LengthUnit& unit, const std::string& help) {
  add_choice<v1::LengthUnit>(command, "--unit", unit, length_units(), help)->required();
}

}  // namespace binpose::client::cli
