"""A circle that follows the finger, and is as wide as the finger is deep; presses are printed.

The mouse touches a virtual orb, its wheel presses deeper; a real orb ignores both. The orb needs a
bundle that estimates contacts.
"""

import pygame

import orbtouch

screen, clock, depth_mm = pygame.display.set_mode((400, 400)), pygame.Clock(), 6.0
with orbtouch.connect() as orb:  # a virtual orb, or connect("/dev/rfcomm0")
    while not pygame.event.peek(pygame.QUIT):
        depth_mm += sum(turn.y for turn in pygame.event.get(pygame.MOUSEWHEEL))
        x, y = pygame.mouse.get_pos()
        place = (x / 80 - 0.5, 4.5 - y / 80)  # grid units from the near left taxel
        orb.touch(*[place] if pygame.mouse.get_pressed()[0] else [], depth_mm=depth_mm)
        for event in orb.events():
            print(event)
        screen.fill("black")
        if (contact := orb.contact) is not None:
            x, y = contact.position
            middle = 80 * (x + 0.5), 80 * (4.5 - y)
            pygame.draw.circle(screen, "orange", middle, 5 * contact.depth_mm)
        pygame.display.flip()
        clock.tick(60)
