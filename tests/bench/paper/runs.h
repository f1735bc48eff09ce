#pragma once

#include <cstddef>
#include <filesystem>

/// The experiments of the paper's section V. Each goes on where an earlier run with the same output was stopped.
namespace binpose::paper {

/// Every `count`-th scene from the `index`-th on: what one of several processes takes.
struct Share {
  std::size_t index = 0;
  std::size_t count = 1;
};

/// Table I: every method on every scene of the share, one thread.
void run_table(const std::filesystem::path& parts, const std::filesystem::path& scenes,
               const std::filesystem::path& output, Share share);

/// Fig. 8 and 9: the paper's preset over the number of vector pairs and over the weights of [Eq. 7]; and the preset as
/// the paper has it, without refinement. On every scene of the share, one thread.
void run_sweep(const std::filesystem::path& parts, const std::filesystem::path& scenes,
               const std::filesystem::path& output, Share share);

/// Fig. 5: part A moved at random, `count` times.
void run_accuracy(const std::filesystem::path& parts, int count, const std::filesystem::path& output);

/// Fig. 3, 6, 7: what their pictures show, a line for each part.
void write_pictures(const std::filesystem::path& parts, const std::filesystem::path& scenes,
                    const std::filesystem::path& output);

}  // namespace binpose::paper
