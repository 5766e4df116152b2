/* A line of the interrupt controller that no pin is on: software asks for the link to be served with the core's
 * priority. */
#ifndef LINK_IRQ_H
#define LINK_IRQ_H

#define LINK_IRQ 6u /* EXTI0 */

#endif
