/* The handlers of this program's vectors. */
#ifndef HANDLERS_H
#define HANDLERS_H

void board_tick(void);
void board_link(void);
void board_serial(void);
void board_can_sent(void);
void board_can_received(void);
void board_can_error(void);
void board_nmi(void);

#endif
