#include "film/film.h"

namespace kanuka::film {

Picture::Channel* Picture::find(const std::string& name) {
    for (Channel& channel : channels)
        if (channel.name == name)
            return &channel;
    return nullptr;
}

const Picture::Channel* Picture::find(const std::string& name) const {
    return const_cast<Picture*>(this)->find(name);
}

} // namespace kanuka::film
