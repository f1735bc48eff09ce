#include <algorithm>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "client/cli/choice.h"
#include "client/cli/command.h"

namespace binpose::client::cli {
namespace {

enum class Shell { kBash, kFish, kZsh };

/// A shell command that prints the IDs of the server's models, one a line.
constexpr const char* kModelIds = "binpose models --timeout 1 2>/dev/null | awk 'NR > 1 && NF > 3 {print $1}'";

/// The long options of a command, each as `--name`.
std::string option_names(const CLI::App& command) {
  std::string names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names += " --" + name;
  }
  return names;
}

/// The few words that an option takes, with spaces between; empty if it takes others.
std::string choices_of(const CLI::Option& option) {
  std::string words = option.get_type_name();
  if (words.find('|') == std::string::npos) return "";
  std::replace(words.begin(), words.end(), '|', ' ');
  return words;
}

/// Options whose values are a few words: one line of the script's `case` each.
void print_choices(const CLI::App& command, std::set<std::string>& seen) {
  for (const CLI::Option* option : command.get_options()) {
    const std::string words = choices_of(*option);
    if (words.empty() || option->get_lnames().empty()) continue;
    if (!seen.insert(option->get_lnames().front()).second) continue;
    std::cout << "    --" << option->get_lnames().front() << ") words=\"" << words << "\" ;;\n";
  }
}

/// For bash, and for zsh, which can read bash's.
void print_bash(const CLI::App& app, const std::vector<const CLI::App*>& commands) {
  std::string names;
  for (const CLI::App* command : commands) names += (names.empty() ? "" : " ") + command->get_name();
  std::cout << "_binpose() {\n"
               "  local word=\"${COMP_WORDS[COMP_CWORD]}\" previous=\"${COMP_WORDS[COMP_CWORD-1]}\" words=\"\"\n"
               "  case \"$previous\" in\n"
               "    --model|model|delete|export)\n"
               "      words=\"$("
            << kModelIds << ")\" ;;\n";
  std::set<std::string> seen;
  for (const CLI::App* command : commands) print_choices(*command, seen);
  std::cout << "  esac\n"
               "  if [ -z \"$words\" ]; then\n"
               "    case \"$word:${COMP_WORDS[1]}\" in\n";
  for (const CLI::App* command : commands) {
    std::cout << "      -*:" << command->get_name() << ") words=\"" << option_names(*command) << option_names(app)
              << "\" ;;\n";
  }
  std::cout << "      -*) words=\"" << option_names(app)
            << "\" ;;\n"
               "    esac\n"
               "    [ \"$COMP_CWORD\" -gt 1 ] || words=\"$words "
            << names
            << "\"\n"
               "  fi\n"
               "  COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
               "}\n"
               "complete -o default -F _binpose binpose\n";
}

/// Text as one word of fish's.
std::string quoted(const std::string& text) {
  std::string word = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') word += '\\';
    word += c;
  }
  return word + "'";
}

/// One `complete` of fish's for each option of a command; `condition`: where they may stand.
void print_fish_options(const CLI::App& command, const std::string& condition) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_lnames().empty()) continue;
    const std::string& name = option->get_lnames().front();
    std::cout << "complete -c binpose" << condition << " -l " << name << " -d " << quoted(option->get_description());
    if (name == "model") {
      std::cout << " -xa " << quoted(std::string("(") + kModelIds + ")");
    } else if (const std::string words = choices_of(*option); !words.empty()) {
      std::cout << " -xa " << quoted(words);
    } else if (option->get_items_expected_max() > 0) {
      std::cout << " -r";
    }
    std::cout << '\n';
  }
}

void print_fish(const CLI::App& app, const std::vector<const CLI::App*>& commands) {
  std::cout << "complete -c binpose -n __fish_use_subcommand -f\n";
  print_fish_options(app, "");
  for (const CLI::App* command : commands) {
    std::cout << "complete -c binpose -n __fish_use_subcommand -a " << command->get_name() << " -d "
              << quoted(command->get_description()) << '\n';
    print_fish_options(*command, " -n " + quoted("__fish_seen_subcommand_from " + command->get_name()));
  }
  std::cout << "complete -c binpose -n '__fish_seen_subcommand_from model delete export' -fa "
            << quoted(std::string("(") + kModelIds + ")") << '\n';
}

ExitCode print_script(const CLI::App& app, Shell shell) {
  const std::vector<const CLI::App*> commands = app.get_subcommands({});
  if (shell == Shell::kZsh) std::cout << "autoload -U +X bashcompinit && bashcompinit\n";
  shell == Shell::kFish ? print_fish(app, commands) : print_bash(app, commands);
  return kOk;
}

}  // namespace

void add_completion(CLI::App& app, const GlobalOptions& /*global*/, Command& chosen) {
  const auto shell = std::make_shared<Shell>(Shell::kBash);
  CLI::App& command =
      *app.add_subcommand("completion", "Print what makes the shell complete commands, options and IDs");
  command.footer(R"(
Examples:
  source <(binpose completion)                 # this shell
  binpose completion | sudo tee /usr/share/bash-completion/completions/binpose >/dev/null
  source <(binpose completion --shell zsh)     # in zsh, after compinit
  binpose completion --shell fish | source     # in fish)");
  add_choice<Shell>(command, "--shell", *shell, {{"bash", Shell::kBash}, {"fish", Shell::kFish}, {"zsh", Shell::kZsh}},
                    "For which shell");
  command.callback([&chosen, shell, &app] { chosen = [shell, &app] { return print_script(app, *shell); }; });
}

}  // namespace binpose::client::cli
