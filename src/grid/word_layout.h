// Where each slot of a layering program lies in a vertex record of 32-bit words: colours take a word, floats
// share one two by two. Derived from the program alone, so compiler, store and transport agree without saying
// so.
#pragma once

#include <cstdint>
#include <vector>

#include "grid/layering.h"

namespace kanuka::grid {

struct WordLayout {
    enum class Word : uint8_t { Color, Amount, HalfPair, Float, Unit };
    struct Place {
        int word = -1;
        int half = 0; // 0 = low, 1 = high 16 bits
    };
    std::vector<Word> words;
    std::vector<Place> places; // parallel to LayeringProgram::slots
    // Which slots a word carries: {slot, -1} for colours, {low, high or -1} for pairs.
    std::vector<std::array<int, 2>> slots_of_word;

    explicit WordLayout(const LayeringProgram& program) {
        int open_pair = -1;
        for (size_t s = 0; s < program.slots.size(); s++) {
            const Slot& slot = program.slots[s];
            if (slot.type == InputType::Color) {
                places.push_back({int(words.size()), 0});
                words.push_back(slot.storage == Storage::Amount ? Word::Amount : Word::Color);
                slots_of_word.push_back({int(s), -1});
            } else if (slot.storage == Storage::Full || slot.storage == Storage::Unit) {
                places.push_back({int(words.size()), 0});
                words.push_back(slot.storage == Storage::Full ? Word::Float : Word::Unit);
                slots_of_word.push_back({int(s), -1});
            } else if (open_pair >= 0) {
                places.push_back({open_pair, 1});
                slots_of_word[open_pair][1] = int(s);
                open_pair = -1;
            } else {
                open_pair = int(words.size());
                places.push_back({open_pair, 0});
                words.push_back(Word::HalfPair);
                slots_of_word.push_back({int(s), -1});
            }
        }
    }
};

// An input that is constant over a grid is kept as floats, at full precision: colours as {c0, c1, c2, scale}
// of their uplifted spectrum, pairs as {low, high}, whole floats and unit vectors as they are.
inline constexpr int ConstantColorFloats = 4, ConstantPairFloats = 2;

} // namespace kanuka::grid
