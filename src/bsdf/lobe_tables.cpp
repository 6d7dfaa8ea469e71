#include "bsdf/lobe_tables.h"

// LOBE_TABLES_BIN names the file that make_tables wrote: one LobeTables.
asm(R"(
    .section .rodata
    .balign 64
    .global kanuka_lobe_tables
    .hidden kanuka_lobe_tables
kanuka_lobe_tables:
    .incbin ")" LOBE_TABLES_BIN R"("
    .previous
)");
