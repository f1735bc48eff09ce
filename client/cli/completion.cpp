#include <iostream>
#include <memory>
#include <set>
#include <string>

#include "client/cli/choice.h"
#include "client/cli/command.h"

namespace binpose::client::cli {
namespace {

enum class Shell { kBash, kZsh };

/// The long options of a command, each as `--name`.
std::string option_names(const CLI::App& command) {
  std::string names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names += " --" + name;
  }
  return names;
}

/// Options whose values are a few words: one line of the script's `case` each.
void print_choices(const CLI::App& command, std::set<std::string>& seen) {
  for (const CLI::Option* option : command.get_options()) {
    std::string words = option->get_type_name();
    if (words.find('|') == std::string::npos || option->get_lnames().empty()) continue;
    if (!seen.insert(option->get_lnames().front()).second) continue;
    for (char& c : words) c = c == '|' ? ' ' : c;
    std::cout << "    --" << option->get_lnames().front() << ") words=\"" << words << "\" ;;\n";
  }
}

ExitCode print_script(const CLI::App& app, Shell shell) {
  const std::vector<const CLI::App*> commands = app.get_subcommands({});
  std::string names;
  for (const CLI::App* command : commands) names += (names.empty() ? "" : " ") + command->get_name();
  if (shell == Shell::kZsh) std::cout << "autoload -U +X bashcompinit && bashcompinit\n";
  std::cout << "_binpose() {\n"
               "  local word=\"${COMP_WORDS[COMP_CWORD]}\" previous=\"${COMP_WORDS[COMP_CWORD-1]}\" words=\"\"\n"
               "  case \"$previous\" in\n"
               "    --model|model|delete)\n"
               "      words=\"$(binpose models --timeout 1 2>/dev/null | awk 'NR > 1 && NF > 3 {print $1}')\" ;;\n";
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
  source <(binpose completion --shell zsh)     # in zsh)");
  add_choice<Shell>(command, "--shell", *shell, {{"bash", Shell::kBash}, {"zsh", Shell::kZsh}}, "For which shell");
  command.callback([&chosen, shell, &app] { chosen = [shell, &app] { return print_script(app, *shell); }; });
}

}  // namespace binpose::client::cli
