"""Console blocks in Markdown: the commands after `$ `, and what they are said to print."""

import re
from dataclasses import dataclass


@dataclass
class Step:
    line: int
    command: str
    output: list  # the lines said to be printed


def steps_of(text):
    steps, inside = [], False
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("```"):
            inside = line == "```console"
        elif inside and line.startswith("$ "):
            steps.append(Step(number, line[2:], []))
        elif inside and steps and steps[-1].command.endswith("\\") and not steps[-1].output:
            steps[-1].command = steps[-1].command[:-1] + line.strip()
        elif inside and steps:
            steps[-1].output.append(line)
    return steps


def inline_steps_of(text):
    """The commands of binpose's that stand within sentences and tables."""
    return [Step(number, command, []) for number, line in enumerate(text.splitlines(), 1)
            for command in re.findall(r"`(binpose(?:-server)? [^`]+)`", line)]


def blocks_of(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def outline(line):
    """A line without its numbers, hashes and widths: what stays from run to run."""
    line = re.sub(r"\b[0-9a-f]{64}\b", "#", line)
    line = re.sub(r"-?\d[\d.:TZ-]*", "#", line)
    return re.sub(r"\s+", " ", line).strip()


def missing(said, printed):
    """The first line that is said to be printed, in this order, and is not; None if all are."""
    lines = iter([outline(line) for line in printed.splitlines()])
    for line in said:
        if line.strip() not in ("...", "") and outline(line) not in lines:  # takes lines up to the one that it finds
            return line
    return None
