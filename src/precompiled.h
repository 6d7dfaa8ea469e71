// Parsed once for all sources that are compiled alike (CMakeLists.txt, kanuka_precompile): what most of them
// include of the standard library, whose headers change with the compiler alone. None of our own headers:
// each change of one would compile everything anew. Sources still include what they use: lint reads them
// without this.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstring>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <variant>
#include <vector>

#include <immintrin.h>
