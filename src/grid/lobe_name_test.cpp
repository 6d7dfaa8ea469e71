// Compiled by two tests: with a name that PhongBrdf has for an input, and with one that it has not.
#include "grid/lobe_table.h"

#define TEXT_OF(name) #name
#define TEXT(name) TEXT_OF(name)
constexpr int Input = kanuka::grid::input_of(kanuka::grid::LobeId::PhongBrdf, TEXT(KANUKA_NAME));
