#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace binpose {

/// Things by the slot of a look-up table: those of slot s are items[first[s]] to items[first[s + 1] - 1].
template <typename T>
struct Slots {
  std::vector<std::uint32_t> first;
  std::vector<T> items;
};

/// Sorts things by slot; those of one slot stay in their order.
///
/// @param placed  slot, below `slot_count`, and thing.
template <typename T>
Slots<T> by_slot(std::span<const std::pair<std::uint32_t, T>> placed, std::size_t slot_count) {
  Slots<T> slots;
  slots.first.assign(slot_count + 1, 0);
  for (const auto& [slot, thing] : placed) ++slots.first[slot + 1];
  for (std::size_t s = 0; s < slot_count; ++s) slots.first[s + 1] += slots.first[s];
  slots.items.resize(placed.size());
  std::vector<std::uint32_t> next = slots.first;
  for (const auto& [slot, thing] : placed) slots.items[next[slot]++] = thing;
  return slots;
}

}  // namespace binpose
