// Conditions of IfBegin and ElseIf.
#pragma once

#include <string>
#include <string_view>

namespace kanuka::ingest {

class Context;

// ||  &&  !  ==  !=  <  <=  >  >=  + - * /  ( )  numbers, 'strings', defined(NAME), and names:
// $Frame; $Option:category:name or $category:name for options; $Attribute:category:name for attributes. An
// unknown name is 0 and the empty string. `problem` is set where the text is no condition.
bool evaluate_condition(std::string_view text, const Context& context, std::string& problem);

} // namespace kanuka::ingest
